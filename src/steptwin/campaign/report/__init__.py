"""Reports of campaigns and of fault matrices: pages without a network, and files for CI."""
