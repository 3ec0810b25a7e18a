# Read by ctest before it runs: one test of ctest for each suite of `program`, which a new process would cost as much time
# as most of its tests take, and whose tests share what they have made. Wants: program, label.
if(NOT EXISTS "${program}")
  get_filename_component(name "${program}" NAME)
  add_test(${name}_NOT_BUILT ${name}_NOT_BUILT)
  return()
endif()
execute_process(COMMAND "${program}" --gtest_list_tests OUTPUT_VARIABLE listed RESULT_VARIABLE result)
if(NOT result EQUAL 0)
  message(FATAL_ERROR "${program} --gtest_list_tests ended with ${result}")
endif()
# Names of suites stand at the beginning of a line and end in a dot; those of tests are indented.
string(REGEX MATCHALL "\n[A-Za-z0-9_/]+\\." suites "\n${listed}")
foreach(suite IN LISTS suites)
  string(STRIP "${suite}" suite)
  string(REGEX REPLACE "\\.$" "" name "${suite}")
  add_test("${name}" "${program}" "--gtest_filter=${suite}*")
  set_tests_properties("${name}" PROPERTIES LABELS "${label}" ENVIRONMENT MESA_SHADER_CACHE_DISABLE=true)
endforeach()
