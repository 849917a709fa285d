"""Where the subject is in each picture: mattes from whatever there is."""
