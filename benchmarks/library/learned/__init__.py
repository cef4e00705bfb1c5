"""Learned tracks: training and test splits over games that are drawn, and scores of learners."""
