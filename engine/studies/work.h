#pragma once
/// Runs the pieces of a study's work on all its threads, with their progress.

#include <functional>
#include <mutex>
#include <string>

#include "engine/studies/study.h"
#include "physics/geometry/parallel.h"

namespace studies {

class Work {
public:
    /// `of` is the number of pieces in all calls of run().
    Work(const StudyOptions& options, int of) : options_(options), of_(of) {}
    /// Calls piece(0) … piece(count − 1), each once; a piece returns what it was.
    void run(int count, const std::function<std::string(int)>& piece) {
        geometry::for_each_index(count, options_.threads, [&](int k) { tell(piece(k)); });
    }
    /// To be called when so many pieces have been done elsewhere.
    void tell(const std::string& what, int pieces = 1) {
        const std::lock_guard lock(telling_);
        done_ += pieces;
        if (options_.progress) options_.progress({done_, of_, what});
    }

private:
    const StudyOptions& options_;
    std::mutex telling_;
    int done_ = 0, of_;
};

}  // namespace studies
