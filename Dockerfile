# The two commands of the README on a Debian 12 with nothing installed: docker build -t backlash_diagnosis .
# The steps are those of scripts/check_fresh.sh, which runs them without Docker.
# SPDX-License-Identifier: BSD-3-Clause
FROM debian:bookworm
RUN apt-get update && apt-get install -y --no-install-recommends ca-certificates git && rm -rf /var/lib/apt/lists/*
COPY . /srv/backlash_diagnosis
WORKDIR /srv/backlash_diagnosis
RUN bash scripts/demo.sh
RUN bash scripts/test.sh
CMD ["bash", "-c", "source build/.ws/devel/setup.bash && exec bash"]
