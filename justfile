# Short names for everyday commands; `just` itself is optional (cargo install just).

viscose := "cargo run --release --locked --quiet -p viscose --"

# list the commands
default:
    @just --list

# run a scene: just run scenes/strands/cantilever.ron --set time.end=1
run SCENE *ARGS:
    {{viscose}} run {{SCENE}} {{ARGS}}

# run every scene of a folder, skipping what is done: just batch scenes/strands -j 2
batch DIR *ARGS:
    {{viscose}} batch {{DIR}} {{ARGS}}

# check scenes without running them
check +SCENES:
    {{viscose}} check {{SCENES}}

# show the stages a scene needs
plan SCENE:
    {{viscose}} plan {{SCENE}}

# the test command of the README
test:
    cargo test --workspace --locked

# the property tests on other and more cases than those of the test command: just properties 42 20000
properties SEED CASES="5000":
    PROPTEST_RNG_SEED={{SEED}} PROPTEST_CASES={{CASES}} cargo test --workspace --locked

# all benchmarks, or one crate's: just bench rods
bench CRATE="":
    cargo bench --locked {{ if CRATE == "" { "--workspace" } else { "-p " + CRATE } }}

# the published kind of study, skipping what is done: just study "0.05 0.2 1" "0.01 1" "1.2 1.5" "0" "8000" 16
study AMPLITUDES="0.05 0.2 1" FRICTIONS="0.01 1" PACKINGS="1 1.5 2" REMOVED="0" MODULI="8000" SEEDS="8" OUT="out/study":
    #!/usr/bin/env bash
    set -euo pipefail
    cargo build --release --locked --quiet -p viscose
    runs=()
    for a in {{AMPLITUDES}}; do for mu in {{FRICTIONS}}; do for p in {{PACKINGS}}; do for r in {{REMOVED}}; do for e in {{MODULI}}; do
        name="amplitude-$a friction-$mu packing-$p removed-$r modulus-$e"
        folder="{{OUT}}/${name// /_}"
        {{viscose}} batch scenes/microgel/interlocking.ron --out "$folder" --no-report \
            --set "title=\"$name\"" --set "output.frames=Count(2)" --set "microgel.seeds={{SEEDS}}" \
            --set "microgel.experiment.amplitude=$a" --set "microgel.friction=$mu" --set "microgel.packing=$p" \
            --set "microgel.preparation.remove_links=$r" --set "microgel.young_modulus=$e"
        runs+=("$folder/interlocking")
    done; done; done; done; done
    awk 'FNR > 1 || NR == 1' "${runs[@]/%interlocking/results.csv}" > "{{OUT}}/results.csv"
    {{viscose}} report "${runs[@]}" --out "{{OUT}}/report.html"

# what each component is worth: scenes with each switch off, change of the end state and of the time, in out/ablation/table.csv
ablation SCENES="scenes/coupled/spun-strand.ron scenes/coupled/wet-pair.ron scenes/coupled/pour-on-strands.ron scenes/coupled/dip-and-pull.ron" OUT="out/ablation":
    #!/usr/bin/env bash
    set -euo pipefail
    cargo build --release --locked --quiet -p viscose
    switches="None Advection Pressure Resampling Shear PlasticFlow Compressibility StrandContact Cohesion Friction \
        FilmAdvection FilmShear FilmPlasticFlow FlowInertia Capture Drag Dripping VolumeFraction"
    mkdir -p "{{OUT}}"
    figure() { sed -n "s/^ *\"$2\": \([-0-9.eE+]*\),\{0,1\}$/\1/p" "$1/summary.json" 2>/dev/null | head -1; }
    echo "scene,off,ended,cpu_seconds,time_share,film_mass_change,strand_energy_change,liquid_energy_change" | tee "{{OUT}}/table.csv"
    for scene in {{SCENES}}; do
        name=$(basename "$scene" .ron)
        whole="{{OUT}}/$name/None"
        for off in $switches; do
            folder="{{OUT}}/$name/$off"
            set_off=(); [ "$off" = None ] || set_off=(--set "disable=[$off]")
            ended=yes
            {{viscose}} run "$scene" --out "$folder" --force --threads 1 --set output.frames=Never "${set_off[@]}" >/dev/null 2>&1 || ended=no
            awk -v name="$name" -v off="$off" -v ended="$ended" \
                -v t="$(figure "$folder" cpu_seconds)" -v t0="$(figure "$whole" cpu_seconds)" \
                -v f="$(figure "$folder" film_mass)" -v f0="$(figure "$whole" film_mass)" \
                -v e="$(figure "$folder" total_energy)" -v e0="$(figure "$whole" total_energy)" \
                -v l="$(figure "$folder" liquid_total_energy)" -v l0="$(figure "$whole" liquid_total_energy)" \
                'function change(a, b) { return b == "" || b == 0 ? "" : sprintf("%.3g", (a - b) / (b < 0 ? -b : b)) }
                 BEGIN { printf "%s,%s,%s,%s,%s,%s,%s,%s\n", name, off, ended, t, (t0 > 0 ? sprintf("%.2f", t / t0) : ""), change(f, f0), change(e, e0), change(l, l0) }' \
                | tee -a "{{OUT}}/table.csv"
        done
    done

# the 24 scenes of strands in liquid, unattended: a summary each, one table, one page, in out/overnight
overnight *ARGS:
    {{viscose}} batch scenes/coupled --out out/overnight {{ARGS}}

# kills every scene of a folder at random again and again, lets it go on, and compares the bytes with those of an undisturbed run
kill-and-resume DIR="scenes/coupled" OUT="out/killed" SEED="1":
    #!/usr/bin/env bash
    set -euo pipefail
    cargo build --release --locked --quiet -p viscose
    RANDOM={{SEED}}
    mkdir -p "{{OUT}}"
    bad=0
    for scene in {{DIR}}/*.ron; do
        name=$(basename "$scene" .ron)
        whole="{{OUT}}/$name-whole" cut="{{OUT}}/$name-cut"
        rm -rf "$whole" "$cut"
        options=(--threads 1 --set output.frames=Never --set "output.checkpoint=Steps(7)")
        begin=$(date +%s%N)
        target/release/viscose run "$scene" --out "$whole" "${options[@]}" >/dev/null 2>&1
        took=$(( ($(date +%s%N) - begin) / 1000000 ))
        kills=0
        while [ ! -e "$cut/summary.json" ]; do
            resume=(); [ ! -d "$cut" ] || resume=(--resume)
            target/release/viscose run "$scene" --out "$cut" "${options[@]}" "${resume[@]}" >/dev/null 2>&1 &
            run=$!
            # after some kills it may end
            [ $kills -ge 3 ] || { sleep "$(awk -v t=$took -v r=$RANDOM 'BEGIN { print 0.02 + t * 1e-3 * 0.6 * r / 32768 }')"; ! kill -9 $run 2>/dev/null || kills=$((kills + 1)); }
            wait $run 2>/dev/null || true
        done
        if cmp -s "$whole/series.csv" "$cut/series.csv"; then echo "same bytes after $kills kills: $name"; else echo "OTHER BYTES: $name"; bad=1; fi
    done
    exit $bad

# validation cases: just validate rods
validate *CASES:
    {{viscose}} validate {{CASES}}

# imported scenes of the C++ code beside its recordings (VISCOSE_REFERENCE names their folder); tables and figures in one page
against-reference *ARGS:
    mkdir -p out
    {{viscose}} validate reference-code --threads 1 --report out/against-reference.html {{ARGS}}

# a page with plots and pictures: just report out/cantilever
report +DIRS:
    {{viscose}} report {{DIRS}}

# API documentation and the reference of scene fields
docs:
    cargo doc --workspace --no-deps --locked
    {{viscose}} schema > docs/scene-reference.md

# what continuous integration runs
ci:
    .ci/run
