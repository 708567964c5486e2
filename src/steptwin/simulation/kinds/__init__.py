"""What a controller, its line and its programs are to a simulation, with a folder for each. Sees scripts and what is below."""
