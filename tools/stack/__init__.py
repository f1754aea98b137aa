"""The services of docker-compose.yml as processes, for tests and benchmarks."""
