# Sourced by apps/quickstart.sh and tests/run.sh: the Debian 12 packages that anticrack is built from.

build_packages=(
  g++ cmake ninja-build pkg-config
  libopenvdb-dev libboost-dev libimath-dev               # sparse grids; Debian forgets that their headers include Boost
  libtbb-dev libeigen3-dev                               # threads, small vectors
  libhwy-dev libdeflate-dev                              # portable SIMD, checksums
  libtiff-dev libpng-dev zlib1g-dev                      # scans, images
  libtomlplusplus-dev libcli11-dev nlohmann-json3-dev libfmt-dev
  libembree-dev libosmesa6-dev libcairo2-dev libfreetype-dev
)
test_packages=(libgtest-dev)

# Installs those of the named packages that are missing; asks nothing. Quick if there is nothing to do.
install_packages() {
  local missing=() package
  for package in "$@"; do
    [ "$(dpkg-query -W -f '${db:Status-Status}' "$package" 2>/dev/null)" = installed ] || missing+=("$package")
  done
  [ ${#missing[@]} -eq 0 ] && return 0

  local as_root=()
  if [ "$(id -u)" -ne 0 ]; then
    if ! command -v sudo >/dev/null; then
      echo "Missing Debian packages: ${missing[*]}. Install them as root, or install sudo." >&2
      return 1
    fi
    as_root=(sudo)
  fi
  echo "== Installing Debian packages: ${missing[*]}"
  "${as_root[@]}" apt-get -q update
  "${as_root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get -q -y install --no-install-recommends "${missing[@]}"
}
