#pragma once
/// Work without the interpreter, and what becomes of it when Python ends: a thread that asks for the
/// interpreter then is ended by it in the middle of C++, which ends the program.

namespace app {

/// Lets other threads of Python run while it exists. When Python begins to end, it waits until what is under
/// way is done; threads other than the one that ends Python then stop for ever before they take the
/// interpreter back. So what a thread holds besides, as a lock, must be let go before this ends.
class Free {
public:
    Free();
    ~Free();
    Free(const Free&) = delete;
    Free& operator=(const Free&) = delete;

private:
    void* state_;
};

/// Thrown out of long work when Python ends, by require_python().
struct PythonEnds {};
void require_python();

/// To be called once, by the module.
void follow_the_end_of_python();

}  // namespace app
