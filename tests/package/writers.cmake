# Refuses a second way to change files. Bytes go through AtomicFile, names through Folder, and the
# places of outputs are decided by check_output(); nothing else opens a file for writing, renames or
# removes one. Each exception names its file and why it is none.
set(ways "ofstream|[^i]fstream[ (]|fopen|freopen|O_WRONLY|O_RDWR|O_CREAT|mkstemp|mkostemp|creat\\(|::unlink|::rename|fs::(remove|rename|copy|resize_file|create_(hard|sym))|filesystem::(remove|rename|copy|resize_file)")
set(exceptions
  "^io/atomic_file\\.cpp$"            # the way
  "^io/folder\\.cpp$"                 # the names
  "^recording/byte_store\\.cpp$"      # a file without a name
  "^program/program\\.cpp$"           # /dev/null for closed standard streams
  "^city/(city|session_writer)\\.cpp$") # sessions of a locked map are removed by their names
# Commands leave it to OutputFile and OutputFolder where a file is written.
set(writers "AtomicFile|PointFileWriter")

set(found "")
file(GLOB_RECURSE sources RELATIVE ${SOURCE_DIR}/src ${SOURCE_DIR}/src/*.cpp ${SOURCE_DIR}/src/*.hpp)
file(GLOB_RECURSE headers RELATIVE ${SOURCE_DIR}/src ${SOURCE_DIR}/include/*.hpp)
foreach(source IN LISTS sources headers)
  set(pattern "${ways}")
  foreach(exception IN LISTS exceptions)
    if(source MATCHES "${exception}")
      set(pattern "")
    endif()
  endforeach()
  if(source MATCHES "^(program|simulate)/")
    string(APPEND pattern "|${writers}")
    string(REGEX REPLACE "^\\|" "" pattern "${pattern}")
  endif()
  if(NOT pattern)
    continue()
  endif()
  file(STRINGS ${SOURCE_DIR}/src/${source} lines REGEX "${pattern}")
  foreach(line IN LISTS lines)
    list(APPEND found "${source}: ${line}")
  endforeach()
endforeach()

list(LENGTH sources count)
if(count LESS 100)
  message(FATAL_ERROR "expected the sources in ${SOURCE_DIR}/src, found ${count}")
elseif(found)
  string(REPLACE ";" "\n  " found "${found}")
  message(FATAL_ERROR "a second way to write:\n  ${found}")
endif()
message("${count} sources have one way to write")
