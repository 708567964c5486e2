"""The studio with its twin inside a page: world, viewers and editor server in workers of the page instead of a service."""
