"""What `mkdocs.yml` builds the site with: pages out of docstrings, figures out of laws, notebooks out of tutorials."""
