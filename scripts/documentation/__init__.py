"""Parts of the documentation's build: pages from docstrings, figures from laws, notebooks from tutorials."""
