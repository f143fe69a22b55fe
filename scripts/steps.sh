# Sourced by scripts/test and .ci/run: named steps with their times, counted at the end.

passed=0
failed=0
skipped=0

begin_steps() {
  step_logs=$1
  mkdir -p "$step_logs"
}

# step NAME COMMAND...: one check. Its output goes to a log, of which a failure shows the end.
step() {
  local name=$1
  shift
  if timed "$name" "$@"; then
    passed=$((passed + 1))
  else
    failed=$((failed + 1))
    return 1
  fi
}

# tests_step NAME RESULTS COMMAND...: a run of many tests that leaves JUnit files under RESULTS.
tests_step() {
  local name=$1 results=$2 status=0 counts
  shift 2
  timed "$name" "$@" || status=1
  read -r -a counts < <(count_tests "$results")
  passed=$((passed + counts[0]))
  skipped=$((skipped + counts[2]))
  # A run that fails without a failing test (a crash, a missing result) is a failure as well.
  failed=$((failed + (counts[1] > status ? counts[1] : status)))
  echo "        $name: ${counts[0]} passed, ${counts[1]} failed, ${counts[2]} skipped"
}

# skip NAME WHY: a check that this machine cannot do. Loud, but no failure.
skip() {
  skipped=$((skipped + 1))
  echo "SKIPPED $1: $2"
}

finish_steps() {
  if [ "$skipped" -gt 0 ]; then echo "$skipped skipped"; fi
  echo "$passed passed, $failed failed"
  exit $((failed > 0))
}

timed() {
  local name=$1 start=$SECONDS log=$step_logs/$1.log
  shift
  if "$@" >"$log" 2>&1; then
    printf 'ok      %-16s %4d s\n' "$name" $((SECONDS - start))
  else
    printf 'FAILED  %-16s %4d s; the end of %s:\n' "$name" $((SECONDS - start)) "$log"
    tail -n 40 "$log"
    return 1
  fi
}

# Passed, failed and skipped tests in the JUnit files below a directory. rostest writes the tests of
# a launch file twice, in its own summary and in the test node's file: the summary counts alone
# where a node left no file.
count_tests() {
  /usr/bin/python3 - "$1" <<'END'
import sys
import xml.etree.ElementTree as ElementTree
from pathlib import Path

cases = {}
for path in sorted(Path(sys.argv[1]).rglob("*.xml")):
    for case in ElementTree.parse(path).iter("testcase"):
        name = (case.get("classname", "").split(".")[-1], case.get("name"))
        tags = {child.tag for child in case}
        state = 1 if tags & {"failure", "error"} else 2 if "skipped" in tags else 0
        key = name if path.name.startswith(("rostest-", "rosunit-")) else (path.stem, *name)
        cases[key] = 1 if 1 in (cases.get(key), state) else state
states = list(cases.values())
print(states.count(0), states.count(1), states.count(2))
END
}
