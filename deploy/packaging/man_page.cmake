# One page of the manual from what a program says of itself. For `cmake -P`: PROGRAM, WORDS, PAGE, PURPOSE, VERSION, OUT,
# HELP2MAN, GZIP.
get_filename_component(folder ${OUT} DIRECTORY)
file(MAKE_DIRECTORY ${folder})
string(STRIP "${WORDS} --help" help)
execute_process(
  COMMAND ${HELP2MAN} --no-info --no-discard-stderr "--help-option=${help}" "--version-string=${VERSION}" "--name=${PURPOSE}"
          --manual=Fulcrum --source=Fulcrum\ ${VERSION} "--output=${OUT}" ${PROGRAM}
  RESULT_VARIABLE result ERROR_VARIABLE error)
if(NOT result EQUAL 0)
  message(FATAL_ERROR "${PROGRAM} ${help}: ${error}")
endif()
file(READ ${OUT} text)
# help2man names a page after its program; these are named as they are called.
get_filename_component(program ${PROGRAM} NAME)
string(TOUPPER ${PAGE} title)
string(REGEX REPLACE "\\.TH [^ ]+ " ".TH ${title} " text "${text}")
string(REGEX REPLACE "(\\.SH NAME\n)[^ ]+ " "\\1${PAGE} " text "${text}")
file(WRITE ${OUT} "${text}")
execute_process(COMMAND ${GZIP} -9nf ${OUT} COMMAND_ERROR_IS_FATAL ANY)
