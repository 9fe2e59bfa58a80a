#pragma once

namespace emtb::blind::wide {

/// `blind_judge --wide ...`: draws benches, asks `emtb`, counts. @return the exit code
int wide_judge(int argc, char** argv);

}  // namespace emtb::blind::wide
