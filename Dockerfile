# docker build -t artde-gym . && mkdir -p runs && docker run --rm -v "$PWD/runs:/home/walker/runs" artde-gym
# The user is 1000; for a folder of another one: docker run --user "$(id -u)" --env HOME=/tmp ...
FROM python:3.11-slim
RUN useradd --create-home --uid 1000 walker
COPY --chown=walker . /home/walker/artde-gym
RUN pip install --no-cache-dir --constraint /home/walker/artde-gym/constraints.txt /home/walker/artde-gym
USER walker
WORKDIR /home/walker
ENTRYPOINT ["artde-gym"]
CMD ["evaluate", "--episodes", "3", "--out", "runs/main"]
