# cmake -DPROGRAM=PATH -DNAME=emtbd -DDATE=... -DVERSION=... -DOUT=FILE -P man_page.cmake: a manual page of what the program's --help says.
execute_process(COMMAND ${PROGRAM} --help OUTPUT_VARIABLE help RESULT_VARIABLE failed)
if(failed)
  message(FATAL_ERROR "${PROGRAM} --help failed")
endif()
string(REGEX MATCH "^[^\n]*" summary "${help}")
string(REGEX REPLACE "\\.$" "" summary "${summary}")
string(REPLACE "\\" "\\e" help "${help}")
string(REPLACE "-" "\\-" help "${help}")
string(REGEX REPLACE "(^|\n)([.'])" "\\1\\\\&\\2" help "${help}")
file(WRITE ${OUT} ".TH ${NAME} 8 \"\" \"emtb ${VERSION}\" \"emtb\"
.SH NAME
${NAME} \\- ${summary}
.SH DESCRIPTION
.nf
${help}.fi
.SH SEE ALSO
.BR emtb (1),
/usr/share/doc/emtb
")
