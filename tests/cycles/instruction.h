/* What the cycle model must know of an instruction. */
#ifndef INSTRUCTION_H
#define INSTRUCTION_H

#include <stdbool.h>
#include <stdint.h>

/* Instructions of one kind have the same price. */
enum kind {
    ALU, MUL, DSP_MUL, DIV, LDR, STR, LDRD, STRD, LDM, STM, BRANCH, BRANCH_REGISTER, TABLE_BRANCH, IT,
    VALU, VMUL, VMAC, VDIV, VMOV, VMOV2, VLDR, VSTR, VLDM, VSTM, MARKER, OTHER, KINDS
};

extern const char *const kind_names[KINDS];

struct instruction {
    uint32_t address;
    uint8_t size;
    uint8_t kind;
    uint8_t registers;        /* how many a multiple load or store moves */
    bool loads_pc;            /* a load that is a jump */
    bool register_offset;     /* address = register + register */
    bool double_precision;    /* a 64-bit floating-point load or store */
    uint32_t address_of;      /* core registers that form an address, one bit each */
    uint32_t writes;          /* core registers that are written */
    uint32_t reads_float;     /* S registers that are read when the instruction starts */
    uint32_t writes_float;    /* S registers that arithmetic writes, a cycle late for a dependent instruction */
};

/* Fills in everything but the address; `bytes` holds `size` bytes. */
void decode(struct instruction *, const uint8_t *bytes);

#endif
