# The structs of an IDL file as tables: field, type, what its comment says.
function cell(text) { gsub(/\|/, "\\|", text); return text }
/^\/\// && !seen { about = about (about == "" ? "" : " ") substr($0, 4) }
!/^\/\// { seen = 1 }
/^const / {
  line = $0; sub(/;.*/, "", line); sub(/^const octet |^const unsigned long |^const long /, "", line)
  constants = constants (constants == "" ? "" : ", ") "`" line "`"
}
/^struct / {
  if (about != "") { printf "\n*%s*\n", about; about = "" }
  if (constants != "") { printf "\nConstants: %s\n", constants; constants = "" }
  printf "\n### %s\n\n| field | type | meaning |\n|---|---|---|\n", $2; inside = 1; next
}
/^}/ { inside = 0 }
inside && /;/ {
  comment = ""; line = $0
  if (match(line, /\/\/ */)) { comment = substr(line, RSTART + RLENGTH); line = substr(line, 1, RSTART - 1) }
  sub(/^ +/, "", line); sub(/; *$/, "", line)
  n = match(line, / [^ ]+$/)
  name = substr(line, n + 1); type = substr(line, 1, n - 1)
  if (match(name, /\[.*\]/)) { type = type " " substr(name, RSTART, RLENGTH); name = substr(name, 1, RSTART - 1) }
  gsub(/fulcrum::idl::/, "", type)
  printf "| `%s` | `%s` | %s |\n", name, cell(type), cell(comment)
}
inside && /^ +\/\// { line = $0; sub(/^ +\/\/ */, "", line); printf "| | | %s |\n", cell(line) }
