/* Thumb-2 and FPv4-SP instructions, as far as their price depends on them. Encodings: Armv7-M Architecture Reference Manual, A5 and A6. */
#include "instruction.h"

const char *const kind_names[KINDS] = {
    "alu", "mul", "dsp_mul", "div", "ldr", "str", "ldrd", "strd", "ldm", "stm", "branch", "branch_register", "table_branch", "it",
    "vadd_vcvt", "vmul", "vmla", "vdiv_vsqrt", "vmov", "vmov2", "vldr", "vstr", "vldm", "vstm", "marker", "other"
};

#define BIT(n) (1u << (n))
enum { SP = 13, PC = 15 };

static uint8_t count(uint32_t bits) { return (uint8_t)__builtin_popcount(bits); }

/* A load or store of one register. */
static void single(struct instruction *i, bool load, uint32_t address_of, unsigned target) {
    i->kind = load ? LDR : STR;
    i->address_of = address_of;
    if (load) i->writes = BIT(target);
}

/* A load or store of a list of registers. */
static void multiple(struct instruction *i, bool load, unsigned base, uint32_t list) {
    i->kind = load ? LDM : STM;
    i->address_of = BIT(base);
    i->registers = count(list);
    if (load) {
        i->writes = list & 0x7fff;
        i->loads_pc = list >> PC & 1;
    }
}

static void decode_16(struct instruction *i, unsigned h) {
    bool load = h >> 11 & 1;
    if (h >> 12 == 5) {
        single(i, (h >> 9 & 7) >= 3, BIT(h >> 3 & 7) | BIT(h >> 6 & 7), h & 7);
        i->register_offset = true;
    } else if (h >> 13 == 3 || h >> 12 == 8) single(i, load, BIT(h >> 3 & 7), h & 7);
    else if (h >> 12 == 9) single(i, load, BIT(SP), h >> 8 & 7);
    else if (h >> 11 == 9) single(i, true, 0, h >> 8 & 7);
    else if ((h & 0xfe00) == 0xb400) multiple(i, false, SP, h & 0x1ff);
    else if ((h & 0xfe00) == 0xbc00) multiple(i, true, SP, (h & 0xff) | (h & 0x100) << 7);
    else if (h >> 12 == 12) multiple(i, load, h >> 8 & 7, h & 0xff);
    else if ((h >> 12 == 13 && (h >> 8 & 15) < 14) || h >> 11 == 0x1c || (h & 0xf500) == 0xb100) i->kind = BRANCH;
    else if ((h & 0xff00) == 0x4700) i->kind = BRANCH_REGISTER;
    else if (h == 0xbf40) i->kind = MARKER;
    else if ((h & 0xff00) == 0xbf00) i->kind = h & 15 ? IT : ALU;
    else if (h >> 10 == 0x11) {
        unsigned target = (h & 7) | (h >> 4 & 8);
        if ((h >> 8 & 3) != 1) i->writes = BIT(target);
        if (target == PC) i->kind = BRANCH_REGISTER;
    } else if (h >> 10 == 0x10) {
        unsigned operation = h >> 6 & 15;
        if (operation != 8 && operation != 10 && operation != 11) i->writes = BIT(h & 7);
        if (operation == 13) i->kind = MUL;
    } else if (h >> 13 == 1) {
        if ((h >> 11 & 3) != 1) i->writes = BIT(h >> 8 & 7);
    } else if (h >> 12 == 10) i->writes = BIT(h >> 8 & 7);
    else i->writes = (h & 0xff00) == 0xb000 ? BIT(SP) : BIT(h & 7);
}

/* Loads, stores and moves between the register files. */
static void decode_float_transfer(struct instruction *i, unsigned h1, unsigned h2, unsigned target) {
    bool load = h1 >> 4 & 1, wide = h2 >> 8 & 1;
    unsigned base = h1 & 15, words = h2 & 0xff;
    if ((h1 & 0xffe0) == 0xec40) {
        i->kind = VMOV2;
        if (load) i->writes = BIT(h2 >> 12) | BIT(base);
        return;
    }
    i->address_of = base == PC ? 0 : BIT(base);
    if ((h1 >> 8 & 1) && !(h1 >> 5 & 1)) {
        i->kind = load ? VLDR : VSTR;
        i->double_precision = wide;
        if (!load && !wide) i->reads_float = BIT(target);
    } else {
        i->kind = load ? VLDM : VSTM;
        i->registers = (uint8_t)words;
        for (unsigned k = target; !load && !wide && k < target + words && k < 32; k++) i->reads_float |= BIT(k);
    }
}

static void decode_float(struct instruction *i, unsigned h1, unsigned h2) {
    unsigned d = (h2 >> 12) << 1 | (h1 >> 6 & 1), n = (h1 & 15) << 1 | (h2 >> 7 & 1), m = (h2 & 15) << 1 | (h2 >> 5 & 1);
    if ((h1 & 0xfe00) == 0xec00) {
        decode_float_transfer(i, h1, h2, d);
        return;
    }
    if (h2 >> 4 & 1) {
        i->kind = VMOV;
        if (h1 >> 4 & 1) {
            if ((h1 & 0xffe0) == 0xee00) i->reads_float = BIT(n);
            if (h2 >> 12 != PC) i->writes = BIT(h2 >> 12);
        }
        return;
    }
    i->kind = VALU;
    i->reads_float = BIT(n) | BIT(m);
    i->writes_float = BIT(d);
    switch (h1 >> 4 & 0xb) {
    case 0: case 1: case 9: case 10: i->kind = VMAC; return; /* the addend is read late */
    case 2: i->kind = VMUL; return;
    case 3: return;
    case 8: i->kind = VDIV; return;
    }
    unsigned operation = h1 & 15;
    bool odd = h2 >> 6 & 1, negate = h2 >> 7 & 1;
    i->reads_float = BIT(m);
    if (!odd || (operation == 0 && !negate)) { /* immediate, or register to register */
        i->kind = VMOV;
        if (!odd) i->reads_float = 0;
        i->writes_float = 0;
    } else if (operation == 1 && negate) i->kind = VDIV; /* square root */
    else if (operation == 4 || operation == 5) {            /* compare */
        i->reads_float = BIT(d) | (operation == 4 ? BIT(m) : 0);
        i->writes_float = 0;
    }
}

static void decode_32(struct instruction *i, unsigned h1, unsigned h2) {
    unsigned group = h1 >> 11 & 3, operation = h1 >> 4 & 0x7f, base = h1 & 15;
    bool load = h1 >> 4 & 1;
    if ((h1 & 0xec00) == 0xec00 && (h2 & 0x0e00) == 0x0a00) decode_float(i, h1, h2);
    else if (group == 1 && (operation & 0x64) == 0) multiple(i, load, base, h2);
    else if (group == 1 && (operation & 0x64) == 4) {
        if ((h1 & 0xfff0) == 0xe8d0 && (h2 & 0xe0) == 0) i->kind = TABLE_BRANCH;
        else if ((h1 & 0xff60) == 0xe840 || (h1 & 0xffe0) == 0xe8c0) i->kind = load ? LDR : STR; /* exclusive */
        else {
            i->kind = load ? LDRD : STRD;
            i->address_of = BIT(base);
            if (load) i->writes = BIT(h2 >> 12) | BIT(h2 >> 8 & 15);
        }
    } else if (group == 2 && h2 & 0x8000) {
        bool jump = h2 & 0x1000 || ((h2 & 0xd000) == 0x8000 && (h1 >> 7 & 7) != 7);
        i->kind = jump ? BRANCH : OTHER;
    } else if (group == 1 || group == 2 || (operation & 0x70) == 0x20) {
        if ((h2 >> 8 & 15) != PC) i->writes = BIT(h2 >> 8 & 15);
    } else if ((operation & 0x71) == 0 || (operation & 0x67) == 1 || (operation & 0x67) == 3 || (operation & 0x67) == 5) {
        unsigned target = h2 >> 12;
        single(i, load, base == PC ? 0 : BIT(base), target);
        i->register_offset = base != PC && !(h1 & 0x80) && !(h2 & 0x800);
        if (i->register_offset) i->address_of |= BIT(h2 & 15);
        if (load && target == PC) {
            i->loads_pc = (operation & 0x67) == 5;
            if (!i->loads_pc) i->kind = ALU; /* a preload hint */
            i->writes = 0;
        }
    } else if ((operation & 0x78) == 0x30) {
        i->kind = (operation & 7) == 0 || (operation & 7) == 7 ? MUL : DSP_MUL;
        i->writes = BIT(h2 >> 8 & 15);
    } else if ((operation & 0x78) == 0x38) {
        bool divide = ((operation & 7) == 1 || (operation & 7) == 3) && (h2 >> 4 & 15) == 15;
        i->kind = divide ? DIV : MUL;
        i->writes = BIT(h2 >> 8 & 15) | (divide ? 0 : BIT(h2 >> 12));
    } else i->kind = OTHER;
}

void decode(struct instruction *i, const uint8_t *bytes) {
    unsigned h1 = bytes[0] | (unsigned)bytes[1] << 8;
    i->kind = ALU;
    if (i->size == 2) decode_16(i, h1);
    else decode_32(i, h1, bytes[2] | (unsigned)bytes[3] << 8);
}
