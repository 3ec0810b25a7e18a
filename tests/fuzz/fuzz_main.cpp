/// A libFuzzer target for the reader that SELDINGER_READER names: see run.sh.

#include <cstdint>
#include <cstdio>
#include <cstdlib>

#include "tests/fuzz/readers.h"

namespace {
const fuzz::Reader* chosen = nullptr;
}

/// assimp loses some blocks of a file that it rejects.
extern "C" const char* __lsan_default_suppressions() {
    return "leak:libassimp\n";
}

extern "C" int LLVMFuzzerInitialize(int*, char***) {
    const char* name = std::getenv("SELDINGER_READER");
    chosen = name ? fuzz::find_reader(name) : nullptr;
    if (chosen) return 0;
    std::fputs("SELDINGER_READER must be one of:", stderr);
    for (const fuzz::Reader& reader : fuzz::readers()) std::fprintf(stderr, " %s", reader.name);
    std::fputs("\n", stderr);
    std::exit(2);
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    fuzz::accepts(*chosen, {reinterpret_cast<const char*>(data), size});
    return 0;
}
