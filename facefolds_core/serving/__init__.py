"""The web player over HTTP: the server, the files that it hands out, where the built player lies."""
