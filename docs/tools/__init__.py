"""What makes the documents and what is released: pictures, the README's table, the site, the hero; not in the wheel."""
