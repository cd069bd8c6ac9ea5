"""The service: a SPARQL endpoint any client can use, and pages where a person sees what the robot knows."""
