# Gives each heading an id: its words in lower case, joined by hyphens.
match($0, /^<h[1-6]>/) {
  level = substr($0, 3, 1)
  text = $0
  gsub(/<[^>]*>/, "", text)
  id = tolower(text)
  gsub(/&[a-z]+;/, "", id)
  gsub(/[^a-z0-9 _-]/, "", id)
  gsub(/ +/, "-", id)
  sub(/^<h[1-6]>/, "<h" level " id=\"" id "\">")
}
{ print }
