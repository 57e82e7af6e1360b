# Installs the build into a folder of its own, runs the installed command and builds and runs the consumer.
# -D build=... -D work=... -D source=...
function(run)
  execute_process(COMMAND ${ARGN} RESULT_VARIABLE status OUTPUT_VARIABLE text ERROR_VARIABLE text)
  if(status)
    message(FATAL_ERROR "${ARGN}: ${status}\n${text}")
  endif()
endfunction()

file(REMOVE_RECURSE ${work})
run(${CMAKE_COMMAND} --install ${build} --prefix ${work}/prefix)
run(${work}/prefix/bin/anticrack --version)
run(${work}/prefix/bin/anticrack info ${work}/prefix/share/anticrack/scenes/quickstart.toml)
run(${CMAKE_COMMAND} -S ${source} -B ${work}/consumer -G Ninja -DCMAKE_PREFIX_PATH=${work}/prefix -DCMAKE_BUILD_TYPE=Release)
run(${CMAKE_COMMAND} --build ${work}/consumer)
run(${work}/consumer/consumer)
file(REMOVE_RECURSE ${work})
