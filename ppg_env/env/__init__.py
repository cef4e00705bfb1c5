"""The environment: rules, compiled kernel, simulator, PettingZoo and Gymnasium interfaces."""
