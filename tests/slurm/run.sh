#!/bin/bash
# tests/slurm/run.sh PROGRAM [RUNS]: starts a Slurm cluster of two nodes on this machine, for this test alone, and shares
# a batch of so many runs, a study and the baking of vessels among them. What is merged must equal what one process makes,
# byte for byte. Exit code 77: Slurm is not installed.
set -u
cd "$(dirname "$0")/../.."
program=$(realpath "${1:?tests/slurm/run.sh PROGRAM [RUNS]}") runs=${2:-20}
for tool in slurmctld slurmd sbatch; do
    command -v "$tool" >/dev/null 2>&1 || { echo "slurm: $tool was not found: ./app/setup.sh installs it"; exit 77; }
done
work=$(mktemp -d "${TMPDIR:-/tmp}/seldinger-slurm-XXXXXX")
end() {
    for file in "$work"/*.pid; do [ ! -f "$file" ] || kill "$(cat "$file")" 2>/dev/null; done
    rm -rf "$work"
}
trap end EXIT
failed=0 begun=()
fail() {
    failed=$((failed + 1))
    echo "slurm: FAILED: $*"
}

# The cluster: one controller and two nodes, which are processes here.
host=$(hostname -s) port=$((20000 + $$ % 10000 * 3 % 20000))
cat >"$work/slurm.conf" <<END
ClusterName=seldinger
SlurmctldHost=$host(127.0.0.1)
SlurmctldPort=$port
SlurmUser=$(id -un)
SlurmdUser=$(id -un)
AuthType=auth/none
CredType=cred/none
StateSaveLocation=$work/state
SlurmdSpoolDir=$work/spool/%n
SlurmctldPidFile=$work/slurmctld.pid
SlurmdPidFile=$work/slurmd-%n.pid
SlurmctldLogFile=$work/slurmctld.log
SlurmdLogFile=$work/slurmd-%n.log
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
SwitchType=switch/none
MpiDefault=none
ReturnToService=2
SelectType=select/cons_tres
SelectTypeParameters=CR_Core
SchedulerType=sched/builtin
SchedulerParameters=sched_interval=1,batch_sched_delay=0,sched_min_interval=1000
NodeName=node[1-2] NodeHostname=$host NodeAddr=127.0.0.1 Port=[$((port + 1))-$((port + 2))] CPUs=1 State=UNKNOWN
PartitionName=all Nodes=node[1-2] Default=YES MaxTime=INFINITE State=UP
END
export SLURM_CONF=$work/slurm.conf SELDINGER_PROGRAM=$program MESA_SHADER_CACHE_DISABLE=true
export SELDINGER_ASSETS="${SELDINGER_ASSETS:-$PWD/assets}"
mkdir -p "$work/state" "$work/spool/node1" "$work/spool/node2"
slurmctld -f "$SLURM_CONF" || exit 1
for node in node1 node2; do slurmd -N $node -f "$SLURM_CONF" || exit 1; done
for ((k = 0; ; ++k)); do
    [ "$(sinfo -h -t idle -o %D 2>/dev/null)" != 2 ] || break
    [ $k -lt 120 ] || { fail "the cluster did not start: $(tail -n 5 "$work"/*.log)"; exit 1; }
    sleep 0.5
done

# One at a time each would wait for most of its time, for sbatch asks ever more rarely whether its jobs have ended.
begin() {  # WORK WORDS OF submit.sh...
    { app/slurm/submit.sh -w "${@:2}" >"$work/said.$1" 2>&1; echo $? >"$work/code.$1"; } &
    begun+=($!)
}
ended() {  # WORK CODE
    [ "$(cat "$work/code.$1")" = "$2" ] || { fail "$1 by shares: exit code $(cat "$work/code.$1"), expected $2"; cat "$work/said.$1"; }
}
same() { diff -r -q "$1" "$2" || fail "$3 of shares differs from that of one process"; }

# A batch, with images in part of it, and one run that cannot be.
mkdir "$work/in"
printf '0 beam on\n1..12 advance 3 mm\n13 rotate 40 deg\n14..20 advance 2 mm\n20 end\n' >"$work/in/x.gw"
{
    printf 'schema = 1\n[[run]]\nscenario = ["s_bend", "straight"]\ncommands = "x.gw"\n[run.set]\n"guidewire.friction" = ['
    for ((k = 0; k < runs / 2; ++k)); do printf '%s0.%04d' "$([ $k = 0 ] || echo ', ')" $((k * 7)); done
    printf ']\n[[run]]\nscenario = "s_bend"\ncommands = "x.gw"\nimages = true\n[run.set]\n'
    printf '"guidewire.diameter_mm" = [0.5, 30.0]\n'
} >"$work/in/list.toml"
begin batch -n 5 batch "$work/in/list.toml" --out "$work/many"
begin study -n 4 study wall-variation --quick --out "$work/study2"
begin plan -n 2 plan s_bend --devices own,glidestraight035,jwire035 --out "$work/plan2" --cache "$work/cache3"
begin bake -n 3 bake rca --seeds 3:6 --cache "$work/baked2"
"$program" batch "$work/in/list.toml" --out "$work/one" --jobs 1 --cache "$work/cache1" >/dev/null 2>&1
"$program" study wall-variation --quick --threads 1 --out "$work/study1" >/dev/null 2>&1
"$program" plan s_bend --devices own,glidestraight035,jwire035 --out "$work/plan1" --threads 2 --cache "$work/cache4" >/dev/null 2>&1
"$program" bake rca --seeds 3:6 --cache "$work/baked1" >/dev/null 2>&1
wait "${begun[@]}"

ended batch 1  # the run that fails
same "$work/one" "$work/many" "a batch"
made=$(grep -c '^[0-9]' "$work/many/batch.csv")
[ "$made" = $((runs / 2 * 2 + 2)) ] || fail "$made rows were found"
for node in node1 node2; do grep -q 'launching batch job\|Launching batch job\|task_p_slurmd_batch_request' "$work/slurmd-$node.log" || fail "$node had no work"; done
echo "slurm: batch: $made runs, 5 shares on 2 nodes, $(find "$work/many" -type f | wc -l) files equal"
ended study 0
same "$work/study1" "$work/study2" "a study"
echo "slurm: study wall-variation: 4 shares, $(find "$work/study2" -type f | wc -l) files equal"
ended plan 0
same "$work/plan1" "$work/plan2" "a plan"
echo "slurm: plan: 3 sets of devices, 2 shares, $(find "$work/plan2" -type f | wc -l) files equal"
ended bake 0
same "$work/baked1" "$work/baked2" "baking"
echo "slurm: bake: 3 anatomies, 3 shares, $(find "$work/baked2" -type f | wc -l) files equal"

# What cannot be is told, and the merge does not wait for ever.
printf 'schema = 1\n[[run]]\nscenario = "straight"\ncommands = "x.gw"\n' >"$work/in/one.toml"
app/slurm/submit.sh -w -n 2 batch "$work/in/one.toml" --out "$work/none" >"$work/said" 2>&1
[ $? = 2 ] && grep -q 'expected at most 1, one a run' "$work/said" || fail "more shares than runs: $(cat "$work/said")"
app/slurm/submit.sh run renal --out x >/dev/null 2>"$work/said"
[ $? = 2 ] && grep -q "batch, study, plan or bake" "$work/said" || fail "another command: $(cat "$work/said")"

echo "slurm: $failed failures"
[ "$failed" = 0 ]
