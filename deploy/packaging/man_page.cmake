# One page of the manual from what a program says of itself. For `cmake -P`: PROGRAM, WORDS, PAGE, PURPOSE, SEE (pages),
# VERSION, FOLDER, HELP2MAN, GZIP.
separate_arguments(WORDS)
separate_arguments(SEE)
# Folders in somebody's home are not those of who builds.
execute_process(
  COMMAND ${CMAKE_COMMAND} -E env --unset=XDG_CONFIG_HOME --unset=XDG_STATE_HOME HOME=~ ${PROGRAM} ${WORDS} --help
  OUTPUT_VARIABLE help COMMAND_ERROR_IS_FATAL ANY)

# help2man knows a synopsis by its capital and further lines of it by "or:", and a term by the two spaces behind it.
string(REGEX REPLACE "^usage:" "Usage:" help "${help}")
string(REPLACE "\nExample:\n" "\nExamples:\n" help "${help}")
string(REGEX REPLACE "\n       ([a-z_]+ [A-Z-])" "\n  or:  \\1" help "${help}")
string(REGEX REPLACE "\n(  --[a-z-]+ [^ \n]+( \\(=[^)\n]*\\))?) ([^ (\n])" "\n\\1  \\3" help "${help}")
file(MAKE_DIRECTORY ${FOLDER})
# It asks a program that is called as the page is.
file(WRITE ${FOLDER}/${PAGE} "#!/bin/sh\ncat <<'END_OF_HELP'\n${help}\nEND_OF_HELP\n")
file(CHMOD ${FOLDER}/${PAGE} PERMISSIONS OWNER_READ OWNER_WRITE OWNER_EXECUTE)
list(TRANSFORM SEE REPLACE "(.+)" ".BR \\1 (1)")
list(JOIN SEE ",\n" see)
# A name is not broken.
string(REPLACE "-" "\\-" see "${see}")
file(WRITE ${FOLDER}/${PAGE}.include "[SEE ALSO]\n.nh\n${see}\n")
execute_process(
  COMMAND ${HELP2MAN} --no-info "--version-string=${VERSION}" "--name=${PURPOSE}" --manual=Fulcrum "--source=Fulcrum ${VERSION}"
          --include=${FOLDER}/${PAGE}.include "--output=${FOLDER}/${PAGE}.1" ${FOLDER}/${PAGE}
  COMMAND_ERROR_IS_FATAL ANY)

# Commands in bold, as options are.
file(READ ${FOLDER}/${PAGE}.1 text)
string(REGEX REPLACE "\n\\.TP\n([a-z][a-z_\\\\-]*)\n" "\n.TP\n.B \\1\n" text "${text}")
file(WRITE ${FOLDER}/${PAGE}.1 "${text}")
execute_process(COMMAND ${GZIP} -9nf ${FOLDER}/${PAGE}.1 COMMAND_ERROR_IS_FATAL ANY)
