/* What ends a program of the tests: a condition that does not hold, and a call that did not do as it should. */
#ifndef EXPECT_H
#define EXPECT_H

#include <stdio.h>

#include "impromptu.h"

/* Ends the program with the line. */
#define EXPECT(condition)                                    \
    do {                                                     \
        if (!(condition)) {                                  \
            fprintf(stderr, "line %d: %s\n", __LINE__, #condition); \
            return 1;                                        \
        }                                                    \
    } while (0)
#define DO(call)                                                                              \
    do {                                                                                      \
        impromptu_status status = (call);                                                     \
        if (status != IMPROMPTU_STATUS_OK) {                                                  \
            fprintf(stderr, "line %d: %s\n", __LINE__, impromptu_status_text(status));        \
            return 1;                                                                         \
        }                                                                                     \
    } while (0)

#endif
