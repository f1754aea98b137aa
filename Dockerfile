# The worker's image: flows, trainings and the `robojackson` command, as a user without rights.
#   docker build -t robojackson:0.2.0 [--build-arg TORCH_INDEX=...] [--build-arg GIT_COMMIT=...] .
FROM python:3.11-slim-bookworm

ENV DEBIAN_FRONTEND=noninteractive PIP_NO_CACHE_DIR=1 PYTHONUNBUFFERED=1
WORKDIR /app

RUN useradd --create-home --home-dir /srv/jackson --uid 10001 jackson && chown jackson:jackson /app

# System libraries first: they change least. bootstrap.sh lists those that are missing; pg_dump and
# pg_restore (of the major version of docker-compose.yml's PostgreSQL) are for backup and restore.
COPY tools/bootstrap.sh tools/bootstrap.sh
RUN apt-get update -qq \
    && apt-get install -y -qq --no-install-recommends \
        postgresql-client-15 $(sh tools/bootstrap.sh missing) \
    && rm -rf /var/lib/apt/lists/*

USER jackson
# Volumes are mounted here; an empty one gets the owner of the folder.
RUN mkdir -p ~/.cache/robojackson

# What is installed depends on these files alone: a changed module does not install it again.
ARG TORCH_INDEX=""
COPY --chown=jackson:jackson pyproject.toml constraints.txt ./
RUN TORCH_INDEX="$TORCH_INDEX" EXTRAS=app,fast,s3,trackers sh tools/bootstrap.sh dependencies
COPY --chown=jackson:jackson . .
RUN .venv/bin/python -m pip install --disable-pip-version-check --quiet --no-deps --editable .

# Last: it changes with every build. Tables record which commit made them; the image has no git.
ARG GIT_COMMIT=""
ENV PATH=/app/.venv/bin:$PATH ROBOJACKSON_STORE=/app/store ROBOJACKSON_COMMIT=$GIT_COMMIT
CMD ["robojackson", "doctor"]
