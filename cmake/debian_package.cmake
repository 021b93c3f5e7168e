# Run by cpack while it stages the files: adds those that Debian's policy asks for.
if(NOT CPACK_GENERATOR STREQUAL "DEB")
  return()
endif()
if(NOT CPACK_TEMPORARY_DIRECTORY)
  message(FATAL_ERROR "adaptive_bvh: cpack does not say where it stages the files")
endif()
if(NOT CPACK_ADAPTIVE_BVH_PREFIX STREQUAL "/usr")
  message(FATAL_ERROR "adaptive_bvh: a Debian package needs a build folder configured with "
    "-DCMAKE_INSTALL_PREFIX=/usr; this one has ${CPACK_ADAPTIVE_BVH_PREFIX}")
endif()
find_program(gzip NAMES gzip REQUIRED)

# Where a package's documents are staged: each component has a folder of its own.
function(set_doc component package)
  set(doc ${CPACK_TEMPORARY_DIRECTORY}${component}${CPACK_PACKAGING_INSTALL_PREFIX}/share/doc/${package}
    PARENT_SCOPE)
endfunction()

function(compress name)
  execute_process(COMMAND ${gzip} -9nf ${doc}/${name} RESULT_VARIABLE status)
  if(NOT status EQUAL 0)
    message(FATAL_ERROR "adaptive_bvh: gzip failed on ${doc}/${name}")
  endif()
endfunction()

file(READ ${CPACK_RESOURCE_FILE_LICENSE} license)
string(REGEX MATCH "Copyright[^\n]*" notice "${license}")
string(REGEX REPLACE "^Copyright (\\([Cc]\\) )?" "" holders "${notice}")
string(REGEX REPLACE "^.*${holders}\n+" "" terms "${license}")
string(STRIP "${terms}" terms)
string(REPLACE "\n\n" "\n.\n" terms "${terms}")
string(REPLACE "\n" "\n " terms "${terms}")
# Of the package whose documents go to ${doc}.
function(write_documents)
  file(MAKE_DIRECTORY ${doc})
  file(WRITE ${doc}/copyright
"Format: https://www.debian.org/doc/packaging-manuals/copyright-format/1.0/
Upstream-Name: adaptive_bvh

Files: *
Copyright: ${holders}
License: BSD-3-clause
 ${terms}
")

  file(READ ${CPACK_ADAPTIVE_BVH_SOURCE}/CHANGELOG.md changes)
  file(WRITE ${doc}/changelog "${changes}")
  compress(changelog)

  string(TIMESTAMP date "%a, %d %b %Y %H:%M:%S +0000" UTC)  # or SOURCE_DATE_EPOCH
  file(WRITE ${doc}/changelog.Debian
"${CPACK_DEBIAN_PACKAGE_SOURCE} (${CPACK_PACKAGE_VERSION}-${CPACK_DEBIAN_PACKAGE_RELEASE}) unstable; urgency=medium

  * Version ${CPACK_PACKAGE_VERSION}: see changelog.gz.

 -- ${CPACK_PACKAGE_CONTACT}  ${date}
")
  compress(changelog.Debian)
endfunction()

# Of the package with the component recording, whose library holds three.js.
function(add_three_notice)
  if(NOT CPACK_ADAPTIVE_BVH_HAS_THREE)
    return()
  endif()
  file(READ ${CPACK_ADAPTIVE_BVH_SOURCE}/src/recording/page/page.html page)
  string(REGEX MATCH "Permission is hereby granted.*CONNECTION WITH THE SOFTWARE[^*]*" expat "${page}")
  string(STRIP "${expat}" expat)
  string(REPLACE "\n\n" "\n.\n" expat "${expat}")
  string(REPLACE "\n" "\n " expat "${expat}")
  file(APPEND ${doc}/copyright "
Files: usr/lib/*/libadaptive_bvh_recording.a
Copyright: 2010-2019 three.js authors
License: Expat
 ${expat}
Comment: The library holds three.js, which is part of the pages that it writes.
")
endfunction()

if(CPACK_DEB_COMPONENT_INSTALL)
  set_doc(/Unspecified ${CPACK_DEBIAN_UNSPECIFIED_PACKAGE_NAME})
  write_documents()
  add_three_notice()
  set_doc(/python ${CPACK_DEBIAN_PYTHON_PACKAGE_NAME})
  write_documents()
else()
  set_doc("" ${CPACK_PACKAGE_NAME})
  write_documents()
  add_three_notice()
endif()
