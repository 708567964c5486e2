"""Interface of a simulation to controllers, their lines and programs, with a folder for each. Sees scripts and what is below."""
