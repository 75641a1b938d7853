# A header as doxygen is to see it: the comment at its top describes the file, a comment behind a member describes that
# member, and lines that a comment indents (equations) stay as they are. The number of lines does not change.
# Usage: awk -f api_doc_filter.awk HEADER
# SPDX-License-Identifier: BSD-3-Clause

# Lines wait for the next one, which says whether an equation begins or ends.
function put(line, equation) {
  if (equation && !in_equation) held = held " \\verbatim"
  if (!equation && in_equation) {
    if (line ~ /^ *\/\/\//) sub(/\/\/\//, "/// \\endverbatim", line)
    else held = held " \\endverbatim"
  }
  in_equation = equation
  if (NR > 1) print held
  held = line
}

FNR == 1 { top = 1; sub(/^\/\/.*/, "/// \\file") }
/^#pragma once/ { top = 0 }
top { sub(/^\/\/( |$)/, "/// ") }
/^ *\/\/ / && behind { sub(/\/\/ /, "///< ") }
!/^ *(\/\/|#|})/ && / +\/\/ / { sub(/\/\/ /, "///< ") }
{
  behind = /\/\/\/< /
  indented = /^ *\/\/\/   / && !behind
  item = /^ *\/\/\/ *(-|[0-9]+\.) / || (item && indented)
  put($0, indented && !item)
}
END { print held }
