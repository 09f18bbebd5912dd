#!/usr/bin/env bash
# Makes the base images that the Dockerfiles name, from Debian's packages alone, where no container registry
# can be reached:  debian:bookworm-slim  and  python:3.11-slim-bookworm  and, with --rust, rust:1-bookworm
# (Debian plus the Rust toolchain of this machine). An image that is there already is left alone.
# Needs root, a Docker engine, and debootstrap (installed from Debian's packages if it is missing).
set -euo pipefail

readonly mirror=${DEBIAN_MIRROR:-http://deb.debian.org/debian}
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

main() {
  docker info >/dev/null 2>&1 || fail "no Docker engine answers; start one, or set DOCKER_HOST"
  make_image debian:bookworm-slim ca-certificates
  make_image python:3.11-slim-bookworm ca-certificates,python3,python3-venv,python3-pip
  if [ "${1:-}" = --rust ]; then
    make_image rust:1-bookworm ca-certificates,gcc,libc6-dev,make,pkg-config add_rust
  fi
}

make_image() { # image, packages, function that adds to the tree
  if docker image inspect "$1" >/dev/null 2>&1; then
    echo "$1: there already"
    return
  fi
  command -v debootstrap >/dev/null || install_debootstrap
  local root="$work/${1//[:\/]/-}"
  echo "$1: bootstrapping from $mirror"
  debootstrap --variant=minbase --include="$2" bookworm "$root" "$mirror" >"$work/log" 2>&1 \
    || fail "debootstrap failed: $(tail -n 3 "$work/log")"
  rm -rf "$root"/var/cache/apt/archives/*.deb "$root"/var/lib/apt/lists/*
  ${3:-true} "$root"
  tar -C "$root" -c . | docker import --change 'CMD ["bash"]' - "$1" >/dev/null
  rm -rf "$root"
}

add_rust() {
  local toolchain
  toolchain=$(rustc --print sysroot) ||
    fail "rust:1-bookworm is made from this machine's toolchain, but rustc is missing"
  mkdir -p "$1/usr/local/rust"
  cp -a "$toolchain"/{bin,lib} "$1/usr/local/rust/"
  ln -s /usr/local/rust/bin/{cargo,rustc,rustdoc} "$1/usr/local/bin/"
}

install_debootstrap() {
  echo "installing debootstrap from Debian's packages"
  { apt-get update && apt-get install -y --no-install-recommends debootstrap; } >"$work/log" 2>&1 \
    || fail "debootstrap is missing and could not be installed: $(tail -n 3 "$work/log")"
}

fail() {
  echo "base-images.sh: $*" >&2
  exit 1
}

main "$@"
