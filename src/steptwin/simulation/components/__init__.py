"""Elements around controllers, a file each, and the context in which they are built. Sees kinds and what is below them."""
