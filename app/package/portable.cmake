# Run by cpack before it packs. It adds the list of all packages that are in the programs or loaded by them, and the licences of
# the former (sbom.sh). For the portable archive (cpack -G TGZ) it adds to what is installed everything the
# programs load, down to glibc and its loader, so that the archive runs where none of it, or an older glibc, is installed:
#   bin/PROGRAM        starts lib/PROGRAM.bin by the archive's own loader
#   lib/               programs and libraries; lib/dri: Mesa's drivers, for the room's window
#   share/fonts, share/doc/LIBRARY-PACKAGE/copyright
list(GET CPACK_INSTALL_CMAKE_PROJECTS 0 build)
# `files`: what the programs load.
function(write_sbom root files)
  execute_process(COMMAND ${CMAKE_CURRENT_LIST_DIR}/sbom.sh ${root} ${build} ${CPACK_PACKAGE_VERSION} ${files}
                  RESULT_VARIABLE result ERROR_VARIABLE said)
  if(NOT result EQUAL 0)
    message(FATAL_ERROR "the list of packages cannot be made: ${said}")
  endif()
endfunction()
if(NOT CPACK_GENERATOR STREQUAL "TGZ")
  set(root ${CPACK_TEMPORARY_DIRECTORY}${CPACK_PACKAGING_INSTALL_PREFIX})
  file(GLOB programs ${root}/bin/*)
  file(GLOB_RECURSE modules ${root}/lib/python3/*.so)
  file(GET_RUNTIME_DEPENDENCIES EXECUTABLES ${programs} LIBRARIES ${modules}
       RESOLVED_DEPENDENCIES_VAR needed UNRESOLVED_DEPENDENCIES_VAR missing)
  write_sbom(${root} "${needed};/usr/share/fonts/truetype/dejavu/DejaVuSans.ttf")
  return()
endif()
set(root ${CPACK_TEMPORARY_DIRECTORY})
set(lib ${root}/lib)

# What only building against the library needs, and Python's module, which is for one Python of one system.
file(REMOVE_RECURSE ${root}/include ${lib})
file(MAKE_DIRECTORY ${lib}/dri)

file(GLOB programs ${root}/bin/*)
file(GLOB folders /usr/lib/x86_64-linux-gnu /lib/x86_64-linux-gnu)
# Loaded by name while a program runs: the window's (GLFW), GL's (libglvnd, Mesa), glibc's.
set(wanted
    libX11.so.6 libXcursor.so.1 libXi.so.6 libXinerama.so.1 libXrandr.so.2 libXrender.so.1 libXxf86vm.so.1 libXext.so.6
    libGL.so.1 libGLX.so.0 libGLX_mesa.so.0 libEGL.so.1 libEGL_mesa.so.0 libgcc_s.so.1 libnss_files.so.2)
set(by_name "")
foreach(name ${wanted})
  foreach(folder ${folders})
    if(EXISTS ${folder}/${name})
      list(APPEND by_name ${folder}/${name})
      break()
    endif()
  endforeach()
endforeach()
file(GLOB drivers /usr/lib/x86_64-linux-gnu/dri/swrast_dri.so /usr/lib/x86_64-linux-gnu/libgallium-*.so)
file(GET_RUNTIME_DEPENDENCIES EXECUTABLES ${programs} LIBRARIES ${by_name} ${drivers}
     RESOLVED_DEPENDENCIES_VAR needed UNRESOLVED_DEPENDENCIES_VAR missing)
if(missing)
  message(FATAL_ERROR "portable archive: expected every library that the programs load, did not find ${missing}")
endif()

foreach(library ${needed} ${by_name})
  get_filename_component(name ${library} NAME)
  file(REAL_PATH ${library} file)
  file(COPY_FILE ${file} ${lib}/${name} ONLY_IF_DIFFERENT)
  list(APPEND files ${library} ${file})
endforeach()
foreach(driver ${drivers})
  get_filename_component(name ${driver} NAME)
  if(name MATCHES "_dri.so$")
    file(REAL_PATH ${driver} file)
    file(COPY_FILE ${file} ${lib}/dri/${name})
  else()
    file(COPY_FILE ${driver} ${lib}/${name} ONLY_IF_DIFFERENT)
  endif()
  list(APPEND files ${driver})
endforeach()
if(NOT EXISTS ${lib}/ld-linux-x86-64.so.2)
  file(REAL_PATH /lib64/ld-linux-x86-64.so.2 loader)
  file(COPY_FILE ${loader} ${lib}/ld-linux-x86-64.so.2)
endif()
file(GLOB vendors /usr/share/glvnd/egl_vendor.d/*mesa.json)
if(vendors)
  file(COPY ${vendors} DESTINATION ${root}/share/glvnd/egl_vendor.d)
endif()

foreach(program ${programs})
  get_filename_component(name ${program} NAME)
  file(RENAME ${program} ${lib}/${name}.bin)
  file(WRITE ${program} [[#!/bin/sh
# Starts the program with the libraries of this archive, whatever the system has.
self=$(readlink -f "$0")
name=${self##*/}
root=${self%/*/*}
export SELDINGER_PORTABLE="$root" SELDINGER_FONTS="${SELDINGER_FONTS-$root/share/fonts}"
# OpenGL of the archive's Mesa, on the processor, for images and for the window.
export LIBGL_DRIVERS_PATH="$root/lib/dri" LIBGL_ALWAYS_SOFTWARE=1
export __GLX_VENDOR_LIBRARY_NAME=mesa __EGL_VENDOR_LIBRARY_DIRS="$root/share/glvnd/egl_vendor.d"
exec "$root/lib/ld-linux-x86-64.so.2" --library-path "$root/lib" "$root/lib/$name.bin" "$@"
]])
  file(CREATE_LINK ../bin/${name} ${lib}/${name} SYMBOLIC)  # where one program starts the other
  file(CHMOD ${program} PERMISSIONS OWNER_READ OWNER_WRITE OWNER_EXECUTE GROUP_READ GROUP_EXECUTE WORLD_READ WORLD_EXECUTE)
endforeach()

file(GLOB fonts /usr/share/fonts/truetype/dejavu/DejaVuSans.ttf /usr/share/fonts/truetype/dejavu/DejaVuSans-Bold.ttf)
file(COPY ${fonts} DESTINATION ${root}/share/fonts)
list(APPEND files ${fonts})

# The licence of everything that was added.
list(REMOVE_DUPLICATES files)
foreach(file ${files})
  execute_process(COMMAND dpkg-query -S ${file} OUTPUT_VARIABLE owner ERROR_QUIET)
  if(owner MATCHES "^([^:, ]+)")
    set(copyright /usr/share/doc/${CMAKE_MATCH_1}/copyright)
    if(EXISTS ${copyright})
      file(COPY_FILE ${copyright} ${root}/share/doc/seldinger/${CMAKE_MATCH_1}.copyright ONLY_IF_DIFFERENT)
    endif()
  endif()
endforeach()
write_sbom(${root} "${files}")
