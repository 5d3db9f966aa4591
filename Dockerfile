# One image for every process of a team: `expedition world`, `expedition server`, `expedition agent`.
FROM python:3.11-slim-bookworm

ENV PYTHONUNBUFFERED=1 PIP_DISABLE_PIP_VERSION_CHECK=1 PIP_NO_CACHE_DIR=1
RUN useradd --create-home --uid 1000 explorer

WORKDIR /opt/expedition
# The dependencies first: they change rarely, and so this layer is kept when the code changes.
COPY pyproject.toml README.md ./
RUN python3 -c "import tomllib; print('\n'.join(tomllib.load(open('pyproject.toml', 'rb'))['project']['dependencies']))" > /tmp/requirements.txt \
    && python3 -m pip install --root-user-action=ignore -r /tmp/requirements.txt && rm /tmp/requirements.txt
COPY . .
RUN python3 -m pip install --root-user-action=ignore --no-deps --editable . \
    && mkdir /runs && chown explorer /runs

USER explorer
WORKDIR /
# Compile the inner loops into the image, so that containers start at once.
RUN expedition run auction --world obstacle_free --robots 2 --max-time 6 --out /tmp/warm --json > /dev/null \
    && rm -r /tmp/warm
VOLUME /runs
ENTRYPOINT ["expedition"]
CMD ["run", "--out", "/runs/latest"]
