#!/bin/bash
# Shares the work of one command among the nodes of a Slurm cluster, and merges what they made.
set -eu

usage() {
    cat <<'END'
app/slurm/submit.sh [OPTIONS] batch LIST --out OUT [...]
app/slurm/submit.sh [OPTIONS] study ID --out OUT [...]
app/slurm/submit.sh [OPTIONS] plan SCENARIO --devices LIST --out OUT [...]
app/slurm/submit.sh [OPTIONS] bake EXERCISE --seeds FIRST:END --cache FOLDER

Submits an array of jobs, each with one share of the command, and a job after them that merges. What is merged equals,
byte for byte, what the command leaves on one machine. Paths must be the same on every node.

  -n SHARDS    shares, and jobs of the array (8)
  -c CORES     cores of a job; batch, study and plan use them all (1)
  -s OPTION    one more option of sbatch, as often as needed: -s --partition=short -s --time=60
  -w           waits for the end, and ends with its exit code

Shares of batch, study and plan are made in OUT.shards, with the output of each job; the folder may be removed after the merge.
A job that Slurm starts again goes on where it was (batch, plan, bake) or begins again (study).
SELDINGER_PROGRAM is the program; else the one built here, or the one on the PATH.
END
}
refuse() {
    printf 'submit: %s\n' "$1" >&2
    exit 2
}

shards=8 cores=1 wait="" more=()
while getopts n:c:s:wh option; do
    case $option in
    n) shards=$OPTARG ;;
    c) cores=$OPTARG ;;
    s) more+=("$OPTARG") ;;
    w) wait=--wait ;;
    h) usage && exit 0 ;;
    *) usage >&2 && exit 2 ;;
    esac
done
shift $((OPTIND - 1))
[ $# -ge 2 ] || { usage >&2 && exit 2; }
[[ $shards =~ ^[1-9][0-9]{0,3}$ ]] || refuse "-n $shards: 1 to 9999 shards are accepted"
[[ $cores =~ ^[1-9][0-9]{0,2}$ ]] || refuse "-c $cores: 1 to 999 cores are accepted"
command -v sbatch >/dev/null 2>&1 || refuse "sbatch was not found; this machine submits to no Slurm cluster"

root=$(cd "$(dirname "$0")/../.." && pwd)
program=${SELDINGER_PROGRAM:-$root/build/release/bin/seldinger}
[ -x "$program" ] || program=$(command -v seldinger) || refuse "no seldinger was found; ./app/build.sh release builds it"

# The words of the command without those that each share has of its own.
kind=$1
shift
out="" seeds="" cache="" words=()
while [ $# -gt 0 ]; do
    word=$1 value=""
    shift
    case $word in
    --*=*) value=${word#*=} word=${word%%=*} ;;
    --out | --seeds | --cache | --shard | --jobs | --threads)
        [ $# -gt 0 ] || refuse "$word: a value is missing"
        value=$1
        shift
        ;;
    esac
    case $word in
    --out) out=$value ;;
    --seeds) seeds=$value ;;
    --cache) cache=$value ;;
    --shard | --jobs | --threads) refuse "$word: it is given by -n and -c" ;;
    --*) if [ -n "$value" ]; then words+=("$word=$value"); else words+=("$word"); fi ;;
    *) words+=("$word") ;;
    esac
done

case $kind in
batch | study | plan)
    [ -n "$out" ] || refuse "$kind: --out is missing; a folder is accepted"
    [ -z "$seeds" ] || refuse "$kind: --seeds goes with bake"
    out=$(realpath -m -- "$out")
    folder=$out.shards
    [ ! -e "$out/batch.json" ] || refuse "$out: runs were found there; a new folder is accepted"
    ;;
bake)
    [[ $seeds =~ ^([0-9]{1,15}):([0-9]{1,15})$ ]] || refuse "bake: --seeds FIRST:END is needed, as 0:100 for 0 to 99"
    first=$((10#${BASH_REMATCH[1]})) end=$((10#${BASH_REMATCH[2]}))
    [ "$first" -lt "$end" ] || refuse "bake: --seeds $seeds: FIRST below END is accepted"
    [ -n "$cache" ] || refuse "bake: --cache is missing; a folder that every node reaches is accepted"
    [ -z "$out" ] || refuse "bake: --out goes with batch, study and plan"
    [ "$shards" -le $((end - first)) ] || shards=$((end - first))
    folder=$(realpath -m -- "$cache").shards
    ;;
*) refuse "'$kind': batch, study, plan or bake is accepted" ;;
esac
[ -z "$cache" ] || cache=$(realpath -m -- "$cache")

# What a share runs: words of a shell, with the number of the share in $SLURM_ARRAY_TASK_ID. Exit code 1 is a result.
quoted=$(printf ' %q' "$program" "$kind" "${words[@]}")
numbered() { printf '%s/$(printf %%04d "$%s")' "$(printf %q "$folder")" "$1"; }
case $kind in
batch)
    share="$quoted --shard \"\$SLURM_ARRAY_TASK_ID/$shards\" --jobs $cores --out $(numbered SLURM_ARRAY_TASK_ID)"
    share+=" --cache $(printf %q "${cache:-$folder/cache}")"
    ;;
study)
    share="$quoted --shard \"\$SLURM_ARRAY_TASK_ID/$shards\" --threads $cores --out $(numbered SLURM_ARRAY_TASK_ID)"
    ;;
plan)
    share="$quoted --shard \"\$SLURM_ARRAY_TASK_ID/$shards\" --threads $cores --out $(numbered SLURM_ARRAY_TASK_ID)"
    share+=" --cache $(printf %q "${cache:-$folder/cache}")"
    ;;
bake)
    # Shares of the same cache, whose locks keep two from growing the same vessels.
    share="n=$((end - first)); k=\$SLURM_ARRAY_TASK_ID; "
    share+="$quoted --seeds \$(($first + n * (k - 1) / $shards)):\$(($first + n * k / $shards)) --cache $(printf %q "$cache")"
    ;;
esac
case $kind in
batch | study | plan)
    merge="$(printf '%q %q merge' "$program" "$kind")"
    for ((k = 1; k <= shards; ++k)); do merge+=$(printf ' %q' "$folder/$(printf %04d "$k")"); done
    merge+=$(printf ' --out %q' "$out")
    ;;
bake) merge="$quoted --seeds $seeds --cache $(printf %q "$cache")" ;; # all are there: it counts them
esac

mkdir -p "$folder"
rm -f "$folder"/job-*.txt "$folder/merge.txt"
script() { printf '#!/bin/bash\n%s\n' "$1"; }
array=$(script "$share || [ \$? -eq 1 ]" |
    sbatch --parsable --job-name="seldinger-$kind" --array="1-$shards" --ntasks=1 --cpus-per-task="$cores" --requeue \
        --chdir="$PWD" --output="$folder/job-%a.txt" --open-mode=append "${more[@]+"${more[@]}"}")
array=${array%%;*}
printf 'submit: job %s has %d shares; %s has their output\n' "$array" "$shards" "$folder"
code=0
merging=$(script "$merge" |
    sbatch $wait --parsable --job-name="seldinger-merge" --dependency="afterok:$array" --kill-on-invalid-dep=yes \
        --ntasks=1 --chdir="$PWD" --output="$folder/merge.txt" "${more[@]+"${more[@]}"}") || code=$?
printf 'submit: job %s merges them\n' "${merging%%;*}"
if [ -n "$wait" ]; then
    if [ -e "$folder/merge.txt" ]; then
        cat "$folder/merge.txt"
    else # Slurm has no exit code for a job that never began
        printf 'submit: nothing was merged, since a share failed:\n' >&2
        tail -n 3 "$folder"/job-*.txt >&2
        code=2
    fi
fi
exit $code
