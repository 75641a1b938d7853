# A header as doxygen is to see it: the comment at its top describes the file, a comment behind a member describes that
# member, and lines that a comment indents (equations) stay as they are. The number of lines does not change.
# Usage: awk -f api_doc_filter.awk HEADER
# SPDX-License-Identifier: BSD-3-Clause

function close_equation() {
  if (equation) held = held " \\endverbatim"
  equation = 0
}

FNR == 1 { top = 1; sub(/^\/\/.*/, "/// \\file") }
/^#pragma once/ { top = 0 }
top { sub(/^\/\/( |$)/, "/// ") }

# Comments behind members, which may go on in the next lines.
/^ *\/\/ / && behind { sub(/\/\/ /, "///< ") }
!/^ *(\/\/|#|})/ && / +\/\/ / { sub(/\/\/ /, "///< ") }
{ behind = /\/\/\/< / }

# Comments in front: as /** ... */, in which doxygen takes equations without the slashes. A line is held until the next
# one says whether the comment or an equation ends with it.
/^ *\/\/\/( |$)/ {
  indented = /^ *\/\/\/   /
  item = /^ *\/\/\/ *(-|[0-9]+\.) / || (item && indented)
  if (!indented || item) close_equation()
  else if (!equation && comment) {
    held = held " \\verbatim"
    equation = 1
  }
  sub(/\/\/\//, comment ? "   " : "/**")
  if (NR > 1) print held
  held = $0
  comment = 1
  next
}
{
  close_equation()
  if (comment) held = held " */"
  comment = item = 0
  if (NR > 1) print held
  held = $0
}
END { print held }
