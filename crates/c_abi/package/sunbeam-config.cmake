# Targets: sunbeam::sunbeam, the shared library, and sunbeam::sunbeam_static.
get_filename_component(_sunbeam_prefix "${CMAKE_CURRENT_LIST_DIR}/../../.." ABSOLUTE)

if(NOT TARGET sunbeam::sunbeam)
    add_library(sunbeam::sunbeam SHARED IMPORTED)
    set_target_properties(
        sunbeam::sunbeam
        PROPERTIES
            IMPORTED_LOCATION "${_sunbeam_prefix}/lib/libsunbeam.so"
            IMPORTED_NO_SONAME TRUE
            INTERFACE_INCLUDE_DIRECTORIES "${_sunbeam_prefix}/include"
    )

    add_library(sunbeam::sunbeam_static STATIC IMPORTED)
    set_target_properties(
        sunbeam::sunbeam_static
        PROPERTIES
            IMPORTED_LOCATION "${_sunbeam_prefix}/lib/libsunbeam.a"
            INTERFACE_INCLUDE_DIRECTORIES "${_sunbeam_prefix}/include"
            INTERFACE_LINK_LIBRARIES "gcc_s;util;rt;pthread;m;dl"
    )
endif()

unset(_sunbeam_prefix)
