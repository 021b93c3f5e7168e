# Gives Eigen's functions in a static library names of their own:
#   cmake -DLIBRARY=FILE -DNM=PROGRAM -DOBJCOPY=PROGRAM -P own_eigen.cmake
# They are weak symbols. Without this the linker would take one copy for the whole program, such as
# the one that a user's source compiled for another processor, where products and sums are fused.
execute_process(COMMAND ${NM} ${LIBRARY} OUTPUT_VARIABLE symbols ERROR_QUIET RESULT_VARIABLE status)
if(NOT status EQUAL 0)
  message(FATAL_ERROR "adaptive_bvh: ${NM} failed on ${LIBRARY}")
endif()
string(REGEX MATCHALL " [VWun] _ZNK?5Eigen[A-Za-z0-9_]*" symbols "${symbols}")
if(NOT symbols)
  return()
endif()
list(REMOVE_DUPLICATES symbols)
list(TRANSFORM symbols REPLACE " [VWun] (.*)" "\\1 \\1.adaptive_bvh\n")
string(CONCAT lines ${symbols})
file(WRITE ${LIBRARY}.symbols "${lines}")
execute_process(COMMAND ${OBJCOPY} --redefine-syms=${LIBRARY}.symbols ${LIBRARY}
  RESULT_VARIABLE status)
if(NOT status EQUAL 0)
  file(REMOVE ${LIBRARY})
  message(FATAL_ERROR "adaptive_bvh: ${OBJCOPY} failed on ${LIBRARY}")
endif()
