#!/usr/bin/env bash
# Builds wheel and sdist, looks into them, and uses the wheel where nothing else of the project is:
# without extras, outside the checkout. Run in a checkout; it leaves it as it is.
#
#     .ci/check_release.sh [PYTHON]
set -euo pipefail

root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
python=$(realpath --no-symlinks "$(command -v "${1:-python3}")")
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
export PIP_DISABLE_PIP_VERSION_CHECK=1

fail() { printf 'FAILED: %s\n' "$1" >&2 && exit 1; }
trap 'fail "line $LINENO: $BASH_COMMAND"' ERR

"$python" -m venv "$work/build"
"$work/build/bin/pip" install --quiet build hatchling
cd "$work"

# The sdist first, and the wheel out of it: so the sdist has all that a wheel needs.
"$work/build/bin/python" -m build --no-isolation --outdir dist "$root" >build.log 2>&1 ||
    { cat build.log && fail "no wheel can be built from the sdist"; }
wheel=$(echo dist/*.whl)
sdist=$(echo dist/*.tar.gz)

"$python" -m zipfile --list "$wheel" >wheel.txt
tar -tzf "$sdist" >sdist.txt
version=$(sed -n 's/^__version__ = "\(.*\)"$/\1/p' "$root/handeye_cli/__init__.py")
[[ $wheel == *"-$version-"* ]] || fail "expected version $version, found $wheel"

# Everything that is not a module and that the package reads must be in the wheel.
while read -r file; do
    grep -q "^$file " wheel.txt || fail "the wheel lacks $file"
done < <(cd "$root" && find handeye_cli -type f ! -name '*.py[co]' && printf 'handeye_cli/%s\n' schemas/*.json)
for folder in tests benchmarks docs sample_data .ci; do
    ! grep -q "^$folder/" wheel.txt || fail "the wheel has $folder/"
done
for file in LICENSE README.md CHANGELOG.md pyproject.toml schemas/ sample_data/ tests/; do
    grep -q "^[^/]*/$file" sdist.txt || fail "the sdist lacks $file"
done

"$python" -m venv used
used/bin/pip install --quiet "$wheel"
handeye=$work/used/bin/handeye
cp -r "$root/sample_data" sample_data
[ "$("$handeye" --version)" = "handeye $version" ] || fail "$("$handeye" --version)"
"$handeye" solve --help >/dev/null
"$handeye" solve sample_data/paper-plate/recording.yaml -q -o calibration.yaml
"$handeye" verify sample_data/paper-plate/recording.yaml -q --leave-one-out -o verification.yaml
grep -q '^schema: handeye/calibration/1' calibration.yaml || fail "no calibration was written"

# Type checkers of those who use the package see its types.
cat >typed.py <<'CODE'
import numpy as np

from handeye_cli import solve_poses

poses = np.zeros((3, 4, 4))
reveal_type(solve_poses(poses, poses).predicted_error.rotation)
solve_poses(poses)
CODE
"$work/build/bin/pip" install --quiet mypy
"$work/build/bin/mypy" --python-executable used/bin/python typed.py >types.txt || true
grep -q 'Revealed type is "\(builtins\.\)\?float"' types.txt || { cat types.txt && fail "the API has no types"; }
grep -q 'Missing positional argument "camera_T_target"' types.txt || fail "a wrong call is not seen"

printf 'ok: %s and %s\n' "$(basename "$wheel")" "$(basename "$sdist")"
