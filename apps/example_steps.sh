# Sourced by the example scripts, in the top folder: what they all do.
source apps/debian_packages.sh
anticrack=build/release/anticrack

say() { printf '== [%d min %02d s] %s\n' $((SECONDS / 60)) $((SECONDS % 60)) "$*"; }

install_and_build() {
  say "Packages: a minute or two if any are missing"
  install_packages "${build_packages[@]}"
  say "Building $anticrack: about six minutes on two cores the first time"
  local tests=()
  [ -f build/release/CMakeCache.txt ] || tests=(-DANTICRACK_TESTS=OFF)
  cmake --preset release "${tests[@]}" --log-level=WARNING
  cmake --build build/release --target anticrack
}

# simulate SCENE RUN WHAT: goes on where an earlier call stopped; does nothing if the run is there already.
simulate() {
  local scene=$1 run=$2 how status=0
  if [ -f "$run/result.json" ] && [ "$run/result.json" -nt "$scene" ] && [ "$run/result.json" -nt "$anticrack" ]; then
    say "Simulation: done before"
    return 0
  elif compgen -G "$run/checkpoint/*.bin" >/dev/null && [ ! -f "$run/result.json" ] && [ "$run/scene.toml" -nt "$scene" ]; then
    say "Simulation: going on from the last checkpoint"
    how=--resume
  else
    say "Simulation: $3"
    how=--force
  fi
  "$anticrack" run "$scene" -o "$run" "$how" || status=$?
  [ "$status" -ne 75 ] || say "Stopped. Run this script again to go on."
  return "$status"
}
