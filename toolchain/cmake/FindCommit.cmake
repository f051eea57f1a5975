# tricoil_find_commit(TREE DIGITS MODIFIED VARIABLE): commit of a tree, from git, or from commit.txt, which `git archive` fills in; empty if
# neither knows it. MODIFIED follows if files differ from the commit.
function(tricoil_find_commit tree digits modified variable)
  set(commit "")
  find_program(git git)
  if(git AND EXISTS ${tree}/.git)
    # --exclude: the hash, not the name of a tag
    execute_process(COMMAND ${git} -C ${tree} describe --always --abbrev=${digits} --exclude=* --dirty=${modified}
      OUTPUT_VARIABLE commit OUTPUT_STRIP_TRAILING_WHITESPACE ERROR_QUIET)
  endif()
  if(commit STREQUAL "")
    file(READ ${tree}/toolchain/cmake/commit.txt archived)
    string(REGEX MATCH "^[0-9a-f]+" commit "${archived}")
    string(SUBSTRING "${commit}" 0 ${digits} commit)
  endif()
  set(${variable} "${commit}" PARENT_SCOPE)
endfunction()
