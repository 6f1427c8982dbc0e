# One page of the manual from what a program says of itself. For `cmake -P`: PROGRAM, WORDS, PAGE, PURPOSE, VERSION, FOLDER,
# HELP2MAN, GZIP.
execute_process(COMMAND ${PROGRAM} ${WORDS} --help OUTPUT_VARIABLE help COMMAND_ERROR_IS_FATAL ANY)
# help2man asks a program that is called as the page is, and knows a synopsis by its capital.
string(REGEX REPLACE "^usage:" "Usage:" help "${help}")
file(MAKE_DIRECTORY ${FOLDER})
file(WRITE ${FOLDER}/${PAGE} "#!/bin/sh\ncat <<'END_OF_HELP'\n${help}\nEND_OF_HELP\n")
file(CHMOD ${FOLDER}/${PAGE} PERMISSIONS OWNER_READ OWNER_WRITE OWNER_EXECUTE)
execute_process(
  COMMAND ${HELP2MAN} --no-info "--version-string=${VERSION}" "--name=${PURPOSE}" --manual=Fulcrum "--source=Fulcrum ${VERSION}"
          "--output=${FOLDER}/${PAGE}.1" ${FOLDER}/${PAGE}
  COMMAND_ERROR_IS_FATAL ANY)
execute_process(COMMAND ${GZIP} -9nf ${FOLDER}/${PAGE}.1 COMMAND_ERROR_IS_FATAL ANY)
