#include <csignal>

/** A constructor of a static object that kills the process. */
static const int kCrash = std::raise(SIGSEGV);
