#!/bin/bash
# A real rock: the scan of a Berea sandstone is characterized, a cube of 200 voxels of it becomes a level set, is compressed until
# it fails, and is rendered. Everything goes to build/release and out/berea; some 500 MB. Run again, it goes on where it stopped.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
source apps/example_steps.sh

scan=assets/scans/berea.tif
scene=assets/scenes/berea_sandstone.toml
out=out/berea
run=$out/run
voxel_size="5.345 um"              # assumed: assets/scans/README.md

install_and_build
mkdir -p "$out"

say "Characterization of all 400^3 voxels: a minute"
"$anticrack" characterize "$scan" -o "$out/rock.json" --voxel-size "$voxel_size" --force

say "A cube of 200^3 voxels as a level set: some seconds"
[ -f "$out/sample.vdb" ] ||
  "$anticrack" import "$scan" -o "$out/sample.vdb" --voxel-size "$voxel_size" --crop 100:300,100:300,100:300

simulate "$scene" "$run" "triaxial compression to failure, 6.4 million particles, seven minutes on two cores"

say "Images: a minute each"
"$anticrack" render "$run" --frame last --field kappa -o "$out/plastic_strain.png"
"$anticrack" render "$run" --frame last --field kappa --cut z=0.000535 -o "$out/plastic_strain_inside.png"
"$anticrack" render "$run" --plot --x=-strain_y --y p,q -o "$out/stress_strain.png"

say "Done. Look at:"
ls -1 "$out"/*.png "$out"/*.json
