"""Methods of ``ppg risk``: analytic and simulated crash probabilities."""
