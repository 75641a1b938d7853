#!/bin/bash
# Writes the API documentation of the public headers as HTML to OUT (default: build/doc of this repository); fails on
# any warning. Needs doxygen, see install_dependencies.sh. Usage: bash scripts/api_doc.sh [OUT]
# SPDX-License-Identifier: BSD-3-Clause
set -euo pipefail
source "$(dirname "${BASH_SOURCE[0]}")/common.sh"

if (($# > 1)) || [[ ${1:-} == -* ]]; then
  sed -n '2,3s/^# //p' "$0"
  [[ ${1:-} == -h || ${1:-} == --help ]] && exit 0
  exit 64
fi
out=${1:-${REPO}/build/doc}
rm -rf "${out}"
mkdir -p "${out}" || fail "cannot create ${out}"
out=$(cd "${out}" && pwd -P)

cd "${REPO}"
version=$(sed -n 's|.*<version>\(.*\)</version>.*|\1|p' package.xml)
(
  cat doc/Doxyfile
  printf 'OUTPUT_DIRECTORY = "%s"\nPROJECT_NUMBER = %s\n' "${out}" "${version}"
) | doxygen - || fail "doxygen has warnings, see above"
[[ -s ${out}/index.html ]] || fail "doxygen wrote no ${out}/index.html"
echo "${out}/index.html"
