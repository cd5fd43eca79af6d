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
