#pragma once

namespace pulson {

/// Maps the work space of OpenBLAS for all threads where the address space of the process is limited (ulimit -v): it
/// maps 128 MiB for each thread that multiplies, and where that is denied it tries again for ever.
/// @throws InputError where the limit does not leave room for it
void reserve_blas_memory();

}  // namespace pulson
