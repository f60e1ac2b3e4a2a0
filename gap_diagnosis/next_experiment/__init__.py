"""The experiment that best separates the explanations that the data leave."""
