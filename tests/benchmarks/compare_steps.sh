#!/usr/bin/env bash
# How much faster is one build than another? Both take turns at the same scene, some tenths of a second each,
# so that neighbours on the machine slow both: the median of the ratios of turns is good to one percent where
# single runs differ by a fifth. A build against itself shows what is noise.
#
#   bash tests/benchmarks/compare_steps.sh OLD NEW ROUNDS THREADS SCENE [KEY=VALUE]...
#
# OLD, NEW: `step_benchmark` of two builds.
set -euo pipefail
if (($# < 5)); then
  sed -n '2,8p' "$0" | cut -c3-
  exit 2
fi
programs=("$1" "$2")
rounds=$3
shift 3

work=$(mktemp -d)
trap 'for descriptor in "${to[@]}"; do exec {descriptor}>&-; done; wait; rm -rf "$work"' EXIT
to=() from=()
for i in 0 1; do
  mkfifo "$work/to$i" "$work/from$i"
  "${programs[i]}" "$@" <"$work/to$i" >"$work/from$i" &
  exec {descriptor}>"$work/to$i"
  to[i]=$descriptor
  exec {descriptor}<"$work/from$i"
  from[i]=$descriptor
  read -r particles <&"${from[i]}" || exit 1 # the program has said why
done

turn() { # build, steps
  echo "$2" >&"${to[$1]}"
  read -r answer <&"${from[$1]}"
}
for i in 0 1; do turn $i 3; done # to warm up
steps=$(awk -v ns="${answer%% *}" -v n="$particles" 'BEGIN { s = 0.2 / (ns * n * 1e-9); print s < 1 ? 1 : int(s) }')
for ((round = 0; round < rounds; ++round)); do
  for i in $((round % 2)) $((1 - round % 2)); do
    turn "$i" "$steps"
    echo "$answer" >>"$work/answers$i"
  done
done

echo "$particles particles, $rounds rounds of $steps steps; ns a particle-step, medians"
printf '%-8s%10s%10s%14s\n' '' old new 'new over old'
phases=(step grid walls sort pass strays)
for i in "${!phases[@]}"; do
  median() { sort -g | awk '{ x[NR] = $1 } END { print (x[int((NR + 1) / 2)] + x[int(NR / 2) + 1]) / 2 }'; }
  column() { cut -d' ' -f$((i + 1)) "$work/answers$1"; }
  ratio=$(paste -d' ' <(column 0) <(column 1) | awk '{ print ($1 > 0 ? $2 / $1 : 1) }' | median)
  printf '%-8s%10.2f%10.2f%14.3f\n' "${phases[i]}" "$(column 0 | median)" "$(column 1 | median)" "$ratio"
done
