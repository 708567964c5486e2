"""Elements around controllers, a file each, and the site where they are built. Sees kinds and what is below them."""
