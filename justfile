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

# validation cases: just validate rods
validate *CASES:
    {{viscose}} validate {{CASES}}

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
