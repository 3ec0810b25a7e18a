#pragma once
/// Work without the interpreter, and what becomes of it when Python ends or its process is forked.

namespace app {

/// Lets other threads of Python run while it exists. The engine's locks are taken within one alone, in which
/// no object of Python is made or let go. So:
///
/// A finaliser or a signal's handler that runs in the middle of it, where a thread took the interpreter back
/// to tell its progress, gets an InputError in place of a lock that its own thread holds.
///
/// A process is forked when all other threads have left theirs, so that it finds every lock open.
///
/// When Python begins to end, it waits until what is under way is done. Threads other than the one that ends
/// Python then stop for ever before they take the interpreter back: it would end them in the middle of C++,
/// which ends the program. So nothing else may be held when this ends.
class Free {
public:
    /// Throws InputError in a thread that has one already.
    Free();
    ~Free();
    Free(const Free&) = delete;
    Free& operator=(const Free&) = delete;

private:
    void* state_;
};

/// A call from Python, which may run Python's code itself: a collection of garbage runs finalisers. Python
/// waits for it before it ends, as it would end the thread in the middle of C++ too. With the interpreter.
class Call {
public:
    Call();
    ~Call();
    Call(const Call&) = delete;
    Call& operator=(const Call&) = delete;
};

/// To be called from long work, without the interpreter: throws PythonEnds when Python ends; else takes the
/// interpreter and asks for signals, whose handlers' exceptions it throws.
void look_after_python();
struct PythonEnds {};

/// To be called once, by the module.
void follow_python();

}  // namespace app
