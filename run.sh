#!/usr/bin/env bash
# run.sh CMD...: make sure the environment is there, then run CMD in it (docs: build the manual). The first call sets up .venv; later calls start at once.
set -euo pipefail
root=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
venv="$root/.venv"
say() { printf 'run.sh: %s\n' "$*" >&2; }
die() { say "$*"; exit 1; }

[ $# -gt 0 ] || { sed -n 2p "$0" >&2; echo 'examples: ./run.sh upd run hertz    ./run.sh pytest' >&2; exit 2; }

# Shared libraries the gmsh wheel loads, and the Debian package of each.
libraries="libGLU.so.1:libglu1-mesa libGL.so.1:libgl1 libXrender.so.1:libxrender1 libXcursor.so.1:libxcursor1 libXfixes.so.3:libxfixes3
 libXext.so.6:libxext6 libXft.so.2:libxft2 libfontconfig.so.1:libfontconfig1 libXinerama.so.1:libxinerama1 libgomp.so.1:libgomp1"

system_libraries() {
  [ "$(uname -s)" = Linux ] || return 0
  local ldconfig known missing="" pair
  ldconfig=$(PATH="$PATH:/sbin:/usr/sbin" command -v ldconfig) || return 0
  known=$("$ldconfig" -p)
  for pair in $libraries; do
    case "$known" in *"${pair%%:*} "*) ;; *) missing="$missing ${pair##*:}" ;; esac
  done
  [ -n "$missing" ] || return 0
  local sudo=""
  [ "$(id -u)" = 0 ] || sudo="sudo -n"
  if command -v apt-get >/dev/null && { [ -z "$sudo" ] || sudo -n true 2>/dev/null; }; then
    say "installing the libraries gmsh needs:$missing"
    { $sudo apt-get update -qq && $sudo env DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends $missing; } >/dev/null \
      || die "apt-get failed. Install these packages, then call again:$missing"
  else
    die "gmsh needs shared libraries that are missing. Ask an administrator for (Debian names):$missing"
  fi
}

environment() {
  command -v python3 >/dev/null || die "python3 (3.11 or newer) is missing: install the packages python3 and python3-venv"
  python3 -c 'import sys; sys.exit(sys.version_info < (3, 11))' || die "python3 is $(python3 -V 2>&1), 3.11 or newer is needed"
  system_libraries
  local extras=dev
  case "$(uname -m)" in x86_64 | amd64) extras=dev,mkl ;; esac
  rm -f "$venv/.ready"
  if [ ! -x "$venv/bin/python" ] || ! "$venv/bin/python" -m pip --version >/dev/null 2>&1; then
    say "making .venv"
    rm -rf "$venv"
    python3 -m venv "$venv" || die "python3 -m venv failed: install the package python3-venv"
  fi
  say "installing upd[$extras] with pinned dependencies (a few minutes the first time)"
  "$venv/bin/python" -m pip install --quiet --disable-pip-version-check -c "$root/.constraints.txt" -e "$root[$extras]" \
    || die "pip could not install the dependencies: see its message above"
  printf '%s\n' "$stamp" >"$venv/.ready"
}

stamp=$(cat "$root/pyproject.toml" "$root/.constraints.txt" "$root/run.sh" | cksum; echo "$root")
if [ ! -f "$venv/.ready" ] || [ "$(cat "$venv/.ready")" != "$stamp" ]; then
  # Two calls at once: the second waits for the first.
  exec 9>"$root/.venv.lock"
  if command -v flock >/dev/null; then flock 9; fi
  if [ ! -f "$venv/.ready" ] || [ "$(cat "$venv/.ready")" != "$stamp" ]; then environment; fi
  exec 9>&-
fi
export PATH="$venv/bin:$PATH" VIRTUAL_ENV="$venv"
[ "$1" != docs ] || set -- python "$root/upd/manual/build.py"
exec "$@"
