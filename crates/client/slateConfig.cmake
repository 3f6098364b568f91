# Package of libslate: the targets slate::slate, and slate::slate_static without a shared library.

get_filename_component(slate_prefix "${CMAKE_CURRENT_LIST_DIR}/../../.." ABSOLUTE)

if(NOT TARGET slate::slate)
    add_library(slate::slate SHARED IMPORTED)
    set_target_properties(slate::slate PROPERTIES
        IMPORTED_LOCATION "${slate_prefix}/lib/libslate.so"
        IMPORTED_SONAME "libslate.so.0"
        INTERFACE_INCLUDE_DIRECTORIES "${slate_prefix}/include")
    add_library(slate::slate_static STATIC IMPORTED)
    set_target_properties(slate::slate_static PROPERTIES
        IMPORTED_LOCATION "${slate_prefix}/lib/libslate.a"
        INTERFACE_INCLUDE_DIRECTORIES "${slate_prefix}/include"
        INTERFACE_LINK_LIBRARIES "gcc_s;util;rt;pthread;m;dl")
endif()

unset(slate_prefix)
