# Reads lines `FILE:#include "HEADER"` and prints each header of a room that a file of another room includes.
function room(path, part) {
  split(path, part, "/")
  return part[1] == "analysis" ? part[1] "/" part[2] : part[1]
}
{
  split($0, part, "\"")
  if (room($0) != room(part[2]) && !(part[2] in seen)) {
    seen[part[2]]
    print part[2]
  }
}
