# How every target of emtb is built: C++20, warnings are errors, optional sanitizers, ccache where there is one.
set(CMAKE_CXX_STANDARD 20)
set(CMAKE_CXX_STANDARD_REQUIRED ON)
set(CMAKE_CXX_EXTENSIONS OFF)
set(CMAKE_RUNTIME_OUTPUT_DIRECTORY ${CMAKE_BINARY_DIR}/bin)
if(NOT CMAKE_BUILD_TYPE)
  set(CMAKE_BUILD_TYPE Release)
endif()
set(CMAKE_CXX_FLAGS_RELEASE "-O2")  # asserts stay on: a bench would rather stop than run on nonsense
set(CMAKE_CXX_FLAGS_RELWITHDEBINFO "-O1 -g1")  # and where a sanitizer looks

# The program runs on any processor of its architecture; its innermost loops are compiled for better ones as well, and chosen
# at run time (emtb_for_processors() below, docs/decisions/simd.md).
add_compile_options(-Wno-psabi)  # vectors are passed between our own units only

find_program(CCACHE ccache)
if(CCACHE)
  set(CMAKE_CXX_COMPILER_LAUNCHER ${CCACHE})
endif()

set(EMTB_SANITIZE "" CACHE STRING "Sanitizers, as -fsanitize= takes them: address,undefined or thread")
if(EMTB_SANITIZE)
  # Null and misaligned pointers stop AddressSanitizer as well; checking each in Eigen's code doubles the time to compile it.
  add_compile_options(-fsanitize=${EMTB_SANITIZE} -fno-omit-frame-pointer -fno-sanitize-recover=all
                      -fno-sanitize=null,alignment,object-size,vptr)
  add_link_options(-fsanitize=${EMTB_SANITIZE})
endif()

# tests/fuzz: libFuzzer has to see which ways the rooms' code takes. Needs clang, from 16 on.
option(EMTB_FUZZ "Builds the fuzz targets of tests/fuzz, and no other test" OFF)
if(EMTB_FUZZ)
  add_compile_options(-fsanitize=fuzzer-no-link)
endif()

# emtb_sees(TARGET): a room is found under the path that it has in the source tree, and nothing else is: who links a room may
# include its headers as "ROOM/...", who does not cannot.
function(emtb_sees target visibility)
  file(RELATIVE_PATH room ${CMAKE_SOURCE_DIR} ${CMAKE_CURRENT_SOURCE_DIR})
  set(path ${CMAKE_BINARY_DIR}/rooms/${target})
  cmake_path(GET room PARENT_PATH above)
  file(MAKE_DIRECTORY ${path}/${above})
  file(CREATE_LINK ${CMAKE_CURRENT_SOURCE_DIR} ${path}/${room} SYMBOLIC)
  target_include_directories(${target} ${visibility} ${path})
  if(NOT visibility STREQUAL "PRIVATE")
    emtb_headers_stand_alone(${target} ${visibility} ${path} ${room})
  endif()
endfunction()

# Each header that other rooms include stands alone: the target all_verify_interface_header_sets compiles each by itself.
execute_process(
  COMMAND grep -rHo --include=*.h --include=*.cpp "^#include \"[^\"]*\"" ${EMTB_HOUSE}
  COMMAND awk -f cmake/between_rooms.awk
  WORKING_DIRECTORY ${CMAKE_SOURCE_DIR} OUTPUT_VARIABLE EMTB_BETWEEN_ROOMS OUTPUT_STRIP_TRAILING_WHITESPACE COMMAND_ERROR_IS_FATAL ANY)
string(REPLACE "\n" ";" EMTB_BETWEEN_ROOMS "${EMTB_BETWEEN_ROOMS}")
function(emtb_headers_stand_alone target visibility path room)
  set(headers ${EMTB_BETWEEN_ROOMS})
  list(FILTER headers INCLUDE REGEX "^${room}/")
  if(headers)
    list(TRANSFORM headers PREPEND ${path}/)
    target_sources(${target} ${visibility} FILE_SET HEADERS BASE_DIRS ${path} FILES ${headers})
    set_target_properties(${target} PROPERTIES VERIFY_INTERFACE_HEADER_SETS ON)
  endif()
endfunction()

# emtb_room(NAME [SOURCES ...] [APART ...] [USES ...]): one room of the house, the static library emtb_NAME. Without sources:
# headers only. APART are sources compiled one by one, so that a program linked with the room loads no library for their sake
# unless it calls them, or loads none but theirs.
function(emtb_room name)
  cmake_parse_arguments(ROOM "" "" "SOURCES;APART;USES" ${ARGN})
  if(ROOM_SOURCES OR ROOM_APART)
    add_library(emtb_${name} STATIC ${ROOM_SOURCES} ${ROOM_APART})
    emtb_sees(emtb_${name} PUBLIC)
    target_link_libraries(emtb_${name} PUBLIC ${ROOM_USES})
    emtb_warnings(emtb_${name})
    emtb_at_once(emtb_${name})
    # The checks of AddressSanitizer take -O1 twice as long to compile; only where numbers are worked out do the tests lose more.
    if(EMTB_SANITIZE MATCHES "address" AND NOT EMTB_FUZZ AND NOT CMAKE_CURRENT_SOURCE_DIR MATCHES "/(analysis|model)(/|$)")
      target_compile_options(emtb_${name} PRIVATE -O0)
    endif()
    set_source_files_properties(${ROOM_APART} PROPERTIES SKIP_UNITY_BUILD_INCLUSION ON)
  else()
    add_library(emtb_${name} INTERFACE)
    emtb_sees(emtb_${name} INTERFACE)
    target_link_libraries(emtb_${name} INTERFACE ${ROOM_USES})
  endif()
endfunction()

# emtb_for_processors(ROOM SOURCE ENTRY): a source of a room that is compiled once more for each better processor that a machine
# may have, with EMTB_PROCESSOR for its name, and of which only the symbols with ENTRY in their names are seen outside. All else
# in it, each copy of an inline function of the standard library or of Eigen, becomes local: otherwise the linker might take that
# copy for the whole program, which then dies on a processor without those instructions.
set(EMTB_PROCESSORS "")
# Not for a sanitizer, which sees all in the portable copy; nor to be fuzzed: clang's linker may be another.
if(CMAKE_SYSTEM_PROCESSOR MATCHES "^(x86_64|AMD64|amd64)$" AND NOT EMTB_FUZZ AND NOT EMTB_SANITIZE)
  set(EMTB_PROCESSORS avx2)
  set(EMTB_OPTIONS_avx2 -mavx2 -mfma)  # what hal/processor.cpp asks for
endif()
function(emtb_for_processors room source entry)
  foreach(processor IN LISTS EMTB_PROCESSORS)
    string(TOUPPER ${processor} upper)
    cmake_path(GET source STEM stem)
    set(objects emtb_${room}_${stem}_${processor})
    add_library(${objects} OBJECT ${source})
    set_target_properties(${objects} PROPERTIES UNITY_BUILD OFF)
    target_compile_definitions(${objects} PRIVATE EMTB_PROCESSOR=${processor})
    # Unique symbols, which GCC makes of what an inline function keeps, cannot be made local.
    target_compile_options(${objects} PRIVATE $<$<CONFIG:Release>:-O3> ${EMTB_OPTIONS_${processor}} $<$<CXX_COMPILER_ID:GNU>:-fno-gnu-unique>)
    target_include_directories(${objects} PRIVATE $<TARGET_PROPERTY:emtb_${room},INCLUDE_DIRECTORIES>)
    emtb_warnings(${objects})
    set(local ${CMAKE_CURRENT_BINARY_DIR}/${stem}_${processor}.o)
    add_custom_command(OUTPUT ${local}
      COMMAND ${CMAKE_LINKER} -r --force-group-allocation -o ${local}.all $<TARGET_OBJECTS:${objects}>
      COMMAND ${CMAKE_OBJCOPY} --wildcard --keep-global-symbol=*${entry}* ${local}.all ${local}
      DEPENDS ${objects} $<TARGET_OBJECTS:${objects}> COMMAND_EXPAND_LISTS VERBATIM
      COMMENT "${stem} for ${processor}, seen by its entry alone")
    set_source_files_properties(${local} PROPERTIES EXTERNAL_OBJECT ON GENERATED ON)
    target_sources(emtb_${room} PRIVATE ${local})
    target_compile_definitions(emtb_${room} PRIVATE EMTB_FOR_${upper})
  endforeach()
endfunction()

# Small sources at once compile in half the time; `debug` is for changing one file. A folder whose files have names of their own in
# common sets EMTB_AT_ONCE to OFF: a unity build must not shape the code.
set(EMTB_AT_ONCE ON)
function(emtb_at_once target)
  if(NOT EMTB_AT_ONCE)
    set_target_properties(${target} PROPERTIES UNITY_BUILD OFF)
  elseif(NOT CMAKE_BUILD_TYPE STREQUAL "Debug")
    set_target_properties(${target} PROPERTIES UNITY_BUILD ON)
  endif()
endfunction()

function(emtb_warnings target)
  if(EMTB_FUZZ)  # g++ is the judge of warnings; clang sees shadows elsewhere
    return()
  endif()
  target_compile_options(${target} PRIVATE -Wall -Wextra -Wpedantic -Wshadow -Wnon-virtual-dtor -Wold-style-cast
                                           -Wunused -Woverloaded-virtual -Wdouble-promotion -Werror)
endfunction()

# emtb_test(ROOM SOURCES ... [USES ...] [SLOW ...]): the tests of one room, one program ROOM_tests, labelled ROOM in ctest. Those
# that a pattern of SLOW names (as --gtest_filter takes them) are labelled `slow` as well: too long to run under a sanitizer.
function(emtb_test room)
  cmake_parse_arguments(TEST "" "" "SOURCES;USES;SLOW" ${ARGN})
  add_executable(${room}_tests ${TEST_SOURCES})
  target_link_libraries(${room}_tests PRIVATE ${TEST_USES} GTest::gmock GTest::gtest_main)
  emtb_warnings(${room}_tests)
  set_target_properties(${room}_tests PROPERTIES UNITY_BUILD ON)  # the headers of a test weigh more than the test
  # What they test is built as shipped; they themselves need not be fast. But the linker takes the first copy of each inline
  # function of the standard library or of Eigen for all of the program, and that of a test comes before the room's: -O0 only
  # where a sanitizer takes most of the time anyway.
  target_compile_options(${room}_tests PRIVATE $<IF:$<CONFIG:Release>,-O1,-O0>)
  if(TEST_SLOW)
    list(JOIN TEST_SLOW ":" slow)
    emtb_discover(${room} quick "-${slow}")
    emtb_discover(${room} slow "${slow}")
    # gtest_discover_tests() takes no list of labels.
    set(labels ${CMAKE_CURRENT_BINARY_DIR}/${room}_labels.cmake)
    file(WRITE ${labels} "if(DEFINED ${room}_slow)  # else the tests are not built
  set_tests_properties(\${${room}_slow} PROPERTIES LABELS \"${room};slow\")
endif()
")
    set_property(DIRECTORY APPEND PROPERTY TEST_INCLUDE_FILES ${labels})
  else()
    emtb_discover(${room} quick "*")
  endif()
endfunction()

function(emtb_discover room which filter)
  # One variable: gtest_discover_tests() takes no list of several, and loses all but the first without a word.
  if(EMTB_SANITIZE MATCHES "thread")
    set(sanitizer TSAN_OPTIONS=suppressions=${CMAKE_SOURCE_DIR}/tests/races_that_are_none.txt)
  else()
    set(sanitizer LSAN_OPTIONS=print_suppressions=0:suppressions=${CMAKE_SOURCE_DIR}/tests/leaks_of_others.txt)
  endif()
  gtest_discover_tests(${room}_tests TEST_PREFIX ${room}: DISCOVERY_TIMEOUT 60 TEST_LIST ${room}_${which} TEST_FILTER ${filter}
                       PROPERTIES LABELS ${room} TIMEOUT 900 ENVIRONMENT ${sanitizer})
endfunction()
