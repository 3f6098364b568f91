# The program `slate` with all features:
#
#   docker build --tag slate .
#   docker run --rm --interactive --tty --network host slate run exp1
#
# The console listens on the loopback interface, which `--network host` shares. Files of a project are at `/home/robot`
# with `--volume "$PWD:/home/robot"`.

# All that checks and tests need; `.devcontainer` is this stage.
FROM rust:1.95-bookworm AS development
ENV DEBIAN_FRONTEND=noninteractive
COPY .ci/tools /tmp/tools
RUN /tmp/tools && rm -r /tmp/tools /var/lib/apt/lists/*

FROM rust:1.95-bookworm AS build
WORKDIR /slate
COPY . .
RUN cargo build --profile fastest --locked --package slate-robotics-cli --features full && strip target/fastest/slate

FROM debian:bookworm-slim
COPY --from=build /slate/target/fastest/slate /usr/local/bin/slate
COPY --from=build /slate/examples /usr/local/share/slate/examples
COPY LICENSE-APACHE LICENSE-MIT /usr/share/doc/slate/
RUN useradd --create-home robot
USER robot
WORKDIR /home/robot
ENTRYPOINT ["slate"]
CMD ["--help"]
