# SPDX-License-Identifier: BSD-3-Clause
# What differs between the systems that the package is built on (doc/reference/systems.md), and nothing of it elsewhere in
# the CMake files: names of targets, versions that are too old, libraries that come from other places. For C++ the one
# difference is src/simulation/sundials_versions.h.

# Boost's own CMake files, which every system here has; CMake 3.30 and later ask which ones are meant.
if(POLICY CMP0167)
  cmake_policy(SET CMP0167 NEW)
endif()

# Where the system's SUNDIALS is too old (Ubuntu 20.04 has 3.1): the prefix of one that was built from source.
set(BACKLASH_DIAGNOSIS_SUNDIALS "" CACHE PATH "Prefix of SUNDIALS 6 or 7, in place of the system's")

# find_sundials(): SUNDIALS' targets and SUNDIALS_VERSION.
macro(find_sundials)
  if(BACKLASH_DIAGNOSIS_SUNDIALS)
    set(SUNDIALS_DIR "" CACHE PATH "found below BACKLASH_DIAGNOSIS_SUNDIALS" FORCE)  # no matter what was found before
    find_package(SUNDIALS QUIET NO_DEFAULT_PATH PATHS ${BACKLASH_DIAGNOSIS_SUNDIALS})
    set(CMAKE_INSTALL_RPATH_USE_LINK_PATH ON)  # no loader looks there by itself
  else()
    find_package(SUNDIALS QUIET)
  endif()
  # Asked here: SUNDIALS' own version file takes no other major version than the one that is asked for. Before 5.1 it has no
  # CMake files, and is not found at all.
  if(NOT SUNDIALS_FOUND OR SUNDIALS_VERSION VERSION_LESS 6 OR NOT SUNDIALS_VERSION VERSION_LESS 8)
    if(SUNDIALS_FOUND)
      set(sundials_found "${SUNDIALS_VERSION} in ${SUNDIALS_DIR} is another")
    else()
      set(sundials_found "with CMake files (since 5.1) was not found")
    endif()
    message(FATAL_ERROR "SUNDIALS 6 or 7 is needed, SUNDIALS ${sundials_found}. Build one from source and name its prefix: "
      "-DBACKLASH_DIAGNOSIS_SUNDIALS=PREFIX (doc/reference/systems.md)")
  endif()
endmacro()

# SUNDIALS_LIBRARIES: what the simulation links. Since 7 a part of all of them is a library of its own.
set(SUNDIALS_LIBRARIES
  SUNDIALS::arkode
  $<TARGET_NAME_IF_EXISTS:SUNDIALS::core>
  SUNDIALS::cvode
  SUNDIALS::nvecserial
  SUNDIALS::sunlinsoldense
  SUNDIALS::sunmatrixdense
  SUNDIALS::sunnonlinsolfixedpoint
  SUNDIALS::sunnonlinsolnewton
)

# find_yaml(): YAML_LIBRARIES, whose target has a namespace since yaml-cpp 0.8.
macro(find_yaml)
  find_package(yaml-cpp REQUIRED)
  set(YAML_LIBRARIES yaml-cpp)
  if(TARGET yaml-cpp::yaml-cpp)
    set(YAML_LIBRARIES yaml-cpp::yaml-cpp)
  endif()
endmacro()

# find_by_hand(NAME HEADER LIBRARY [FOLDER...]): NAME_INCLUDE and NAME_LIBRARY of what has no CMake files; the header may be in
# one of the folders. REQUIRED of find_path() and find_library() means nothing before CMake 3.18.
macro(find_by_hand name header library)
  find_path(${name}_INCLUDE ${header} PATH_SUFFIXES ${ARGN})
  find_library(${name}_LIBRARY ${library})
  if(NOT ${name}_INCLUDE OR NOT ${name}_LIBRARY)
    message(FATAL_ERROR "${header} or lib${library} was not found (scripts/install_dependencies.sh names the packages)")
  endif()
endmacro()

# find_urdf(): URDF_LIBRARY and URDF_INCLUDES. rosdep and CMake call the package by different names, and since 4 its headers
# are in folders of their own.
macro(find_urdf)
  find_by_hand(URDF urdf_parser/urdf_parser.h urdfdom_model urdfdom)
  find_by_hand(URDF_MODEL urdf_model/model.h urdfdom_model urdfdom_headers)
  set(URDF_INCLUDES ${URDF_INCLUDE} ${URDF_MODEL_INCLUDE})
endmacro()

# gtest_library(VARIABLE): catkin builds gtest by itself, and names its target as it likes, where CMake finds no library.
macro(gtest_library variable)
  set(${variable} gtest_main)
  if(TARGET GTest::gtest_main)
    set(${variable} GTest::gtest_main)
  endif()
endmacro()
