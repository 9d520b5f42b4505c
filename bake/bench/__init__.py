"""Measurements that the documentation quotes; `main.py bench` runs them."""
