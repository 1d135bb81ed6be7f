#include "command_line.h"

int main(int argc, char** argv) { return etalon::app::runCommandLine({argv + 1, argv + argc}); }
